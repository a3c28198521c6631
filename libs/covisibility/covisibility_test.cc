#include "covisibility/covisibility.h"

#include <gtest/gtest.h>

namespace skein::covisibility_test {

TEST(CovisibilityGraph, BothPhotosOfAPairHaveItInTheOrderItCame) {
  CovisibilityGraph graph;
  graph.Add(2, 1, 40, 10);
  graph.Add(3, 1, 50, 11);
  ASSERT_EQ(graph.EdgesOf(1).size(), 2u);
  EXPECT_EQ(graph.EdgesOf(1)[0].other_id, 2);
  EXPECT_EQ(graph.EdgesOf(1)[0].num_inliers, 40);
  EXPECT_EQ(graph.EdgesOf(1)[1].other_id, 3);
  EXPECT_EQ(graph.EdgesOf(1)[1].seq, 11);
  ASSERT_EQ(graph.EdgesOf(3).size(), 1u);
  EXPECT_EQ(graph.EdgesOf(3)[0].other_id, 1);
}

TEST(CovisibilityGraph, AnUnknownPhotoHasNoPairs) {
  EXPECT_TRUE(CovisibilityGraph().EdgesOf(7).empty());
}

}  // namespace skein::covisibility_test
