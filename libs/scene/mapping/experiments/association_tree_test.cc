#include "mapping/experiments/association_tree.h"

#include <gtest/gtest.h>

namespace skein::association_tree_test {

const auto kAll = [](uint32_t) { return true; };

TEST(AssociationTree, WeighsByShortestPathAndRipple) {
  SimilarityLists lists;
  lists.Add(2, {{1, 1.0}});
  lists.Add(3, {{2, 1.0}});
  lists.Add(4, {{3, 1.0}});
  lists.Add(5, {{4, 1.0}});
  const auto tree = BuildAssociationTree(lists, 5, kAll);
  const double s = SimilarityFromDistance(1.0);
  ASSERT_EQ(tree.size(), 5u);
  EXPECT_EQ(tree[0].image_id, 5u);
  EXPECT_DOUBLE_EQ(tree[0].weight, 1);
  EXPECT_DOUBLE_EQ(tree[1].weight, 1);
  EXPECT_DOUBLE_EQ(tree[2].weight, 1 / (2 / s));
  EXPECT_DOUBLE_EQ(tree[3].weight, 1 / (3 / s) / (3 / s));
  EXPECT_EQ(tree[4].image_id, 1u);
  EXPECT_EQ(tree[4].weight, 0);
}

TEST(AssociationTree, TakesOnlyMembersAndTopN) {
  SimilarityLists lists;
  std::vector<std::pair<uint32_t, double>> others;
  for (uint32_t id = 1; id <= 20; ++id) others.emplace_back(id, 0.5 + 0.01 * id);
  lists.Add(100, others);
  const auto tree = BuildAssociationTree(lists, 100, [](uint32_t id) { return id % 2 == 0; });
  ASSERT_EQ(tree.size(), 9u);
  EXPECT_EQ(tree[1].image_id, 2u);
  EXPECT_EQ(tree[8].image_id, 16u);
}

TEST(AssociationTree, ListsTakeInLaterPhotos) {
  SimilarityLists lists;
  lists.Add(1, {});
  lists.Add(2, {{1, 0.9}});
  lists.Add(3, {{1, 0.4}});
  ASSERT_EQ(lists.Of(1).size(), 2u);
  EXPECT_EQ(lists.Of(1)[0].image_id, 3u);
}

TEST(AssociationTree, OfAPhotoWithoutSimilarOnesIsThePhoto) {
  EXPECT_EQ(BuildAssociationTree(SimilarityLists(), 7, kAll).size(), 1u);
}

}  // namespace skein::association_tree_test
