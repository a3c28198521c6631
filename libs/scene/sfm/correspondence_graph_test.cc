#include "sfm/correspondence_graph.h"

#include <gtest/gtest.h>

#include <stdexcept>

namespace skein::correspondence_graph_test {

CorrespondenceGraph OfThreeImages() {
  CorrespondenceGraph graph;
  for (const ImageId id : {1, 2, 3}) graph.AddImage(id, 2);
  graph.AddCorrespondences(1, 2, {{0, 1}, {1, 0}});
  graph.AddCorrespondences(1, 3, {{0, 0}});
  return graph;
}

TEST(CorrespondenceGraph, FindsAMatchFromBothEnds) {
  const CorrespondenceGraph graph = OfThreeImages();
  const auto& of_first = graph.FindCorrespondences(1, 0);
  ASSERT_EQ(of_first.size(), 2u);
  EXPECT_EQ(of_first[0].image_id, 2u);
  EXPECT_EQ(of_first[0].point2D_idx, 1u);
  EXPECT_EQ(of_first[1].image_id, 3u);
  ASSERT_EQ(graph.FindCorrespondences(2, 1).size(), 1u);
  EXPECT_EQ(graph.FindCorrespondences(2, 1)[0].image_id, 1u);
  EXPECT_TRUE(graph.FindCorrespondences(3, 1).empty());
}

TEST(CorrespondenceGraph, TellsAMatchOfTwoKeypointsAlone) {
  const CorrespondenceGraph graph = OfThreeImages();
  EXPECT_TRUE(graph.IsTwoViewObservation(1, 1));
  EXPECT_FALSE(graph.IsTwoViewObservation(1, 0));
  EXPECT_FALSE(graph.IsTwoViewObservation(2, 1)) << "the other keypoint has two matches";
  EXPECT_FALSE(graph.IsTwoViewObservation(3, 1)) << "no match";
}

TEST(CorrespondenceGraph, RefusesWhatIsNotThere) {
  CorrespondenceGraph graph = OfThreeImages();
  EXPECT_THROW(graph.AddImage(1, 2), std::logic_error);
  EXPECT_THROW(graph.FindCorrespondences(4, 0), std::out_of_range);
  EXPECT_THROW(graph.FindCorrespondences(1, 2), std::out_of_range);
  EXPECT_THROW(graph.AddCorrespondences(1, 4, {}), std::out_of_range);
}

}  // namespace skein::correspondence_graph_test
