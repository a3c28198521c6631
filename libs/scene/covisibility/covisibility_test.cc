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

constexpr int8_t kCalibrated = 2, kPanoramic = CovisibilityGraph::Edge::kPanoramic;

void AddPair(CovisibilityGraph* graph, int64_t id1, int64_t id2, int32_t num_inliers,
             int8_t geometry) {
  graph->Add(id1, {id2, num_inliers, 1, geometry == kPanoramic ? 0.0F : 0.1F, 0, geometry});
}

bool AreOfOneSpot(const CovisibilityGraph& graph, int64_t id1, int64_t id2) {
  for (const CovisibilityGraph::Edge& edge : graph.EdgesOf(id1)) {
    if (edge.other_id == id2) return graph.IsOfOneSpot(id1, edge);
  }
  return false;
}

// The crops of one photo that are farthest apart have few matches, and noise that a translation
// seems to explain: four of 65 pairs of one photo of fountain-P11.
TEST(CovisibilityGraph, StrongerRotationsOverAThirdPhotoOutweighAPairsOwnGeometry) {
  CovisibilityGraph graph;
  AddPair(&graph, 1, 11, 569, kPanoramic);
  AddPair(&graph, 11, 12, 3734, kPanoramic);
  AddPair(&graph, 1, 12, 179, kCalibrated);
  EXPECT_TRUE(AreOfOneSpot(graph, 1, 12));
  EXPECT_TRUE(AreOfOneSpot(graph, 12, 1));
  EXPECT_TRUE(AreOfOneSpot(graph, 1, 11));
}

TEST(CovisibilityGraph, AWeakerRotationOrOneOfTwoOutweighsNothing) {
  CovisibilityGraph graph;
  AddPair(&graph, 1, 2, 300, kPanoramic);
  AddPair(&graph, 2, 3, 900, kPanoramic);
  AddPair(&graph, 1, 3, 400, kCalibrated);
  EXPECT_FALSE(AreOfOneSpot(graph, 1, 3)) << "300 inliers are fewer than 400";
  AddPair(&graph, 3, 4, 900, kPanoramic);
  AddPair(&graph, 1, 4, 900, kCalibrated);
  EXPECT_FALSE(AreOfOneSpot(graph, 1, 3)) << "photo 4 was taken a step away from photo 1";
}

}  // namespace skein::covisibility_test
