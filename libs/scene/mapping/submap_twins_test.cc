#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <vector>

#include "testing/submap_rig.h"

namespace skein::submap_twins_test {

// Every `every`-th keypoint of `photo` that sees the first twin is matched to the second one.
// Keypoints of the second twin have no matches.
void ConfuseTwins(size_t photo, int every, SyntheticScene* scene) {
  const int half = static_cast<int>(scene->points.size()) / 2;
  for (TwoViewPair& pair : scene->pairs[photo]) {
    std::map<int, uint32_t> keypoint_of;
    const std::vector<int>& seen = scene->visible[pair.other_id - 1];
    for (size_t k = 0; k < seen.size(); ++k) keypoint_of[seen[k]] = static_cast<uint32_t>(k);
    std::vector<std::pair<uint32_t, uint32_t>> inliers;
    for (const auto& [mine, other] : pair.inliers) {
      const int point = scene->visible[photo][mine];
      if (point >= half) continue;
      if (point % every != 0) {
        inliers.emplace_back(mine, other);
      } else if (keypoint_of.count(point + half) > 0) {
        inliers.emplace_back(mine, keypoint_of[point + half]);
      }
    }
    pair.inliers = inliers;
  }
}

SyntheticOptions Twins() {
  SyntheticOptions options;
  options.shape = SyntheticOptions::Shape::kTwins;
  return options;
}

SyntheticOptions ManyPhotosOfTwins(int num_photos) {
  SyntheticOptions options = Twins();
  options.num_points = 1600;
  options.num_photos = num_photos;
  options.step_deg = 5;
  return options;
}

// Until others come that know the place it may stand in either.
TEST(Submap, APhotoWhoseMatchesAgreeOnTwoPlacesEndsInTheRightOne) {
  SubmapRig run(Twins());
  ConfuseTwins(3, 2, &run.scene);
  ASSERT_TRUE(run.Start(0, 2));
  run.Feed(1);
  for (const size_t i : {3, 4, 5, 6, 7}) run.Feed(i);
  EXPECT_TRUE(run.map.map().IsRegistered(4));
  EXPECT_LT(run.PositionErrorPercent(), 0.3);
}

TEST(Submap, RegistersAPhotoOfWhichAFewMatchesLeadToATwin) {
  SubmapRig run(Twins());
  ConfuseTwins(3, 4, &run.scene);
  ASSERT_TRUE(run.Start(0, 2));
  run.Feed(1);
  run.Feed(3);
  EXPECT_TRUE(run.map.map().IsRegistered(4));
  EXPECT_LT(run.PositionErrorPercent(), 0.3);
}

// A photo of the second twin that comes first gets to the first twin's place. Photos that follow
// contradict it, and it keeps a fraction of its matches.
TEST(Submap, WithdrawsAPhotoThatLaterOnesContradictAndTakesItBackOnNewEvidence) {
  SubmapRig run(ManyPhotosOfTwins(16));
  ConfuseTwins(3, 1, &run.scene);  // all its matches lead to the other twin
  ASSERT_TRUE(run.Start(0, 2));
  run.Feed(1);
  run.Feed(3);
  ASSERT_TRUE(run.map.map().IsRegistered(4));
  for (size_t i = 4; i < 16; ++i) run.Feed(i);
  run.map.Finish(run.Sink());
  const auto withdrawn = std::find_if(run.events.begin(), run.events.end(), [](const auto& event) {
    return event.image_id == 4 && event.state == PhotoEvent::State::kWithdrawn;
  });
  ASSERT_NE(withdrawn, run.events.end());
  EXPECT_FALSE(withdrawn->refusal.text.empty());
  EXPECT_EQ(run.NumRegistered(), 16);
  EXPECT_LT(run.PositionErrorPercent(), 0.3);
}

// A photo of the second twin, and three that match only it and each other, stand at the first
// twin's place as one group. Then photos come that match both groups.
TEST(Submap, MovesAGroupThatGrewInTheWrongPlace) {
  SubmapRig run(ManyPhotosOfTwins(20));
  ConfuseTwins(8, 1, &run.scene);
  for (const size_t photo : {9, 10, 11}) {
    TwoViewPairs& pairs = run.scene.pairs[photo];
    pairs.erase(std::remove_if(pairs.begin(), pairs.end(),
                               [](const TwoViewPair& pair) { return pair.other_id < 9; }),
                pairs.end());
  }
  ASSERT_TRUE(run.Start(0, 2));
  for (size_t i = 1; i < 12; ++i) {
    if (i != 2) run.Feed(i);
  }
  ASSERT_EQ(run.NumRegistered(), 12);
  EXPECT_GT(run.PositionErrorPercent(), 5);
  for (size_t i = 12; i < 20; ++i) run.Feed(i);
  run.map.Finish(run.Sink());
  // Half of the first one's matches stay wrong: it may wait.
  for (ImageId id = 1; id <= 20; ++id) EXPECT_TRUE(id == 9 || run.map.map().IsRegistered(id)) << id;
  EXPECT_LT(run.PositionErrorPercent(), 0.3);
}

}  // namespace skein::submap_twins_test
