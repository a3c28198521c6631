#include "mapping/misplaced.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "testing/synthetic_scene.h"

namespace skein::misplaced_test {

// Photos 1 to 6 stand at their true poses. Photos 7 and 8 have points of their own and their true
// relative pose, but stand elsewhere.
class MisplacedTest : public testing::Test {
 protected:
  void SetUp() override {
    AddToMap(scene_, scene_.pairs, &map_);
    RegisterAtTruth(scene_, {1, 2, 3, 4, 5, 6}, Eigen::Vector3d::Zero(), &map_);
    RegisterAtTruth(scene_, {7, 8}, Eigen::Vector3d(3, 0, 0), &map_);
  }

  const SyntheticScene scene_ = MakeScene({});
  SceneMap map_;
};

TEST_F(MisplacedTest, TheSmallerOfTwoGroupsThatContradictEachOtherIsMisplaced) {
  EXPECT_EQ(FindMisplaced({}, map_), std::vector<ImageId>({7, 8}));
}

TEST_F(MisplacedTest, AroundAPhotoTheSameIsFoundWithinReach) {
  EXPECT_EQ(FindMisplacedAround({}, map_, 7), std::vector<ImageId>({7, 8}));
}

TEST_F(MisplacedTest, BeyondTheNearestPhotosNothingIsLookedAt) {
  MisplacedOptions options;
  options.max_photos_around = 3;
  EXPECT_TRUE(FindMisplacedAround(options, map_, 1).empty());
}

// The pair of 4 and 5 alone connects photos 1 to 4 with 5 to 8. Each of 1 to 3 matches each of 6 to
// 8 along an object of both places: more matches, in weak pairs.
TEST(Misplaced, AnObjectThatTwoPlacesHaveInCommonContradictsNobody) {
  const SyntheticScene scene = MakeScene({});
  std::vector<TwoViewPairs> pairs = scene.pairs;
  size_t num_tying = 0, num_false = 0;
  for (ImageId id = 5; id <= 8; ++id) {
    TwoViewPairs kept;
    for (TwoViewPair& pair : pairs[id - 1]) {
      if (id == 5 && pair.other_id == 4) {
        pair.inliers.resize(pair.inliers.size() / 2);
        num_tying = pair.inliers.size();
      }
      if (id > 5 && pair.other_id < 4) {
        pair.inliers.clear();
        for (uint32_t i = 0; i < 80; ++i) pair.inliers.emplace_back(i, i + 100);
        num_false += pair.inliers.size();
      } else if (pair.other_id < 5 && (id > 5 || pair.other_id < 4)) {
        continue;
      }
      kept.push_back(std::move(pair));
    }
    pairs[id - 1] = std::move(kept);
  }
  ASSERT_GT(num_false, num_tying + MisplacedOptions().min_contradiction);
  SceneMap map;
  AddToMap(scene, pairs, &map);
  RegisterAtTruth(scene, {1, 2, 3, 4, 5, 6, 7, 8}, Eigen::Vector3d::Zero(), &map);
  MisplacedOptions options;
  options.min_pair_share = 0;
  EXPECT_FALSE(FindMisplaced(options, map).empty());
  options.min_pair_share = 0.2;  // of pairs of this scene, which has few points
  EXPECT_TRUE(FindMisplaced(options, map).empty());
}

}  // namespace skein::misplaced_test
