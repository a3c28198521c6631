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
  EXPECT_EQ(FindMisplaced(map_), std::vector<ImageId>({7, 8}));
}

TEST_F(MisplacedTest, AroundAPhotoTheSameIsFoundWithinReach) {
  EXPECT_EQ(FindMisplacedAround(map_, 7), std::vector<ImageId>({7, 8}));
}

TEST_F(MisplacedTest, BeyondTheNearestPhotosNothingIsLookedAt) {
  EXPECT_TRUE(FindMisplacedAround(map_, 1, 3).empty());
}

// The pair of 4 and 5 alone connects photos 1 to 4 with 5 to 8, by 300 matches. Each of 1 to 3
// matches each of 6 to 8 along an object of both places: more matches in all, `num_false` a pair.
std::vector<ImageId> MisplacedByObjectOfTwoPlaces(uint32_t num_false) {
  constexpr size_t kNumTying = 300;
  SyntheticOptions options;
  options.num_points = 6000;  // 80 are less than kMinPairShare of a strongest pair's matches
  const SyntheticScene scene = MakeScene(options);
  std::vector<TwoViewPairs> pairs = scene.pairs;
  for (ImageId id = 5; id <= 8; ++id) {
    TwoViewPairs kept;
    for (TwoViewPair& pair : pairs[id - 1]) {
      if (id == 5 && pair.other_id == 4) pair.inliers.resize(kNumTying);
      if (id > 5 && pair.other_id < 4) {
        pair.inliers.clear();
        for (uint32_t i = 0; i < num_false; ++i) pair.inliers.emplace_back(i, i + 100);
      } else if (pair.other_id < 5 && (id > 5 || pair.other_id < 4)) {
        continue;
      }
      kept.push_back(std::move(pair));
    }
    pairs[id - 1] = std::move(kept);
  }
  EXPECT_GT(9 * num_false, kNumTying + kMinContradiction);
  SceneMap map;
  AddToMap(scene, pairs, &map);
  RegisterAtTruth(scene, {1, 2, 3, 4, 5, 6, 7, 8}, Eigen::Vector3d::Zero(), &map);
  EXPECT_TRUE(map.IsStrongPair(4, 5, kMinPairShare));
  return FindMisplaced(map);
}

TEST(Misplaced, AnObjectThatTwoPlacesHaveInCommonContradictsNobody) {
  EXPECT_TRUE(MisplacedByObjectOfTwoPlaces(80).empty());
  EXPECT_FALSE(MisplacedByObjectOfTwoPlaces(400).empty()) << "of strong pairs";
}

}  // namespace skein::misplaced_test
