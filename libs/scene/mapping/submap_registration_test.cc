#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "testing/submap_rig.h"

namespace skein::submap_registration_test {

TEST(Submap, RegistersAllPhotosOfAnArc) {
  SubmapRig run(SyntheticOptions{});
  run.FeedAll();
  EXPECT_EQ(run.NumRegistered(), 8);
  EXPECT_LT(run.PositionErrorPercent(), 0.3);
  run.map.Finish(run.Sink());
  EXPECT_LT(run.PositionErrorPercent(), 0.3);
  EXPECT_GT(run.map.Statistics().mean_track_length, 4);
}

TEST(Submap, WithstandsOutliers) {
  SyntheticOptions options;
  options.outlier_ratio = 0.3;
  SubmapRig run(options);
  run.FeedAll();
  EXPECT_EQ(run.NumRegistered(), 8);
  EXPECT_LT(run.PositionErrorPercent(), 0.5);
}

TEST(Submap, RegistersPhotosOfAPlaneOnceTheMapStands) {
  SyntheticOptions options;
  options.shape = SyntheticOptions::Shape::kPlane;
  SubmapRig run(options);
  run.FeedAll();
  EXPECT_EQ(run.NumRegistered(), 8);
  EXPECT_LT(run.PositionErrorPercent(), 1.0);
}

TEST(Submap, RefusesToStartFromPureRotationOrTinyBaseline) {
  SyntheticOptions options;
  options.path = SyntheticOptions::Path::kRotation;
  options.step_deg = 4;
  SubmapRig rotation(options);
  EXPECT_FALSE(rotation.Start(0, 2, 2));
  EXPECT_EQ(rotation.NumRegistered(), 0);
  options = {};
  options.step_deg = 0.1;
  SubmapRig tiny(options);
  EXPECT_FALSE(tiny.Start(0, 1, 2));
  EXPECT_EQ(tiny.NumRegistered(), 0);
}

TEST(Submap, StartsFromForwardMotion) {
  SyntheticOptions options;
  options.path = SyntheticOptions::Path::kForward;
  SubmapRig run(options);
  ASSERT_TRUE(run.Start(0, 2, 1));
  for (const size_t i : {1, 3, 4, 5, 6, 7}) run.Feed(i);
  ASSERT_EQ(run.NumRegistered(), 8);
  // Centres on a line have no unique similarity to the truth: their distances are compared.
  const auto center = [&](ImageId id) {
    return run.map.map().reconstruction().Image(id).ProjectionCenter();
  };
  const double step = (center(8) - center(1)).norm() / 7;
  for (ImageId id = 2; id <= 8; ++id) {
    EXPECT_NEAR((center(id) - center(id - 1)).norm(), step, 0.02 * step);
  }
}

TEST(Submap, RegistersAPhotoTurnedOnTheSpotOrHardlyMoved) {
  for (const double distance : {0.0, 0.002}) {
    SyntheticOptions options;
    options.turned_photo = 3;
    options.turned_distance = distance;
    SubmapRig run(options);
    run.FeedAll();
    EXPECT_EQ(run.NumRegistered(), 8) << distance;
    EXPECT_LT(run.PositionErrorPercent(), 0.3) << distance;
    run.map.Finish(run.Sink());
    EXPECT_LT(run.PositionErrorPercent(), 0.3) << distance;
  }
}

TEST(Submap, RegistersPhotosThatMoveForwardOnceTheMapStands) {
  SyntheticOptions options;
  options.path = SyntheticOptions::Path::kArcThenForward;
  options.num_photos = 12;
  SubmapRig run(options);
  run.FeedAll();
  EXPECT_EQ(run.NumRegistered(), 12);
  EXPECT_LT(run.PositionErrorPercent(), 0.5);
}

TEST(Submap, DefersAPhotoWithLowOverlapUntilANeighbourComes) {
  SyntheticOptions options;
  SubmapRig run(options);
  // Photo 7 is known to photo 6 only, and photo 6 comes later.
  run.scene.pairs[7].erase(run.scene.pairs[7].begin(), run.scene.pairs[7].begin() + 6);
  ASSERT_TRUE(run.Start(0, 2));
  run.Feed(1);
  run.Feed(7);
  EXPECT_EQ(run.events.back().image_id, 8);
  EXPECT_EQ(run.events.back().state, PhotoEvent::State::kDeferred);
  for (const size_t i : {3, 4, 5, 6}) run.Feed(i);
  EXPECT_TRUE(run.map.map().IsRegistered(8));
}

TEST(Submap, DefersAPhotoWithLowOverlapForGood) {
  SubmapRig run(SyntheticOptions{});
  for (TwoViewPair& pair : run.scene.pairs[3]) pair.inliers.resize(20);
  run.scene.pairs[3].resize(1);
  ASSERT_TRUE(run.Start(0, 2));
  run.Feed(1);
  run.Feed(3);
  EXPECT_EQ(run.events.back().state, PhotoEvent::State::kDeferred);
  EXPECT_EQ(run.events.back().refusal.text, "too few visible points");
  const size_t num_events = run.events.size();
  run.map.RetryDeferred();
  while (run.map.Step(run.Sink())) continue;
  EXPECT_EQ(run.events.size(), num_events);  // told once
}

TEST(Submap, DefersAPhotoWhosePointsLieInOneCorner) {
  SyntheticOptions options;
  options.num_points = 20000;
  SubmapRig run(options);
  ASSERT_TRUE(run.Start(0, 2));
  run.Feed(1);
  // Only matches in a patch of 30 px are left.
  TwoViewPairs pairs = run.scene.pairs[3];
  for (TwoViewPair& pair : pairs) {
    std::vector<std::pair<uint32_t, uint32_t>> corner;
    for (const auto& inlier : pair.inliers) {
      const Keypoint& keypoint = run.scene.photos[3].keypoints[inlier.first];
      if (std::abs(keypoint.x - 600) < 15 && std::abs(keypoint.y - 450) < 15) {
        corner.push_back(inlier);
      }
    }
    pair.inliers = corner;
  }
  run.scene.pairs[3] = pairs;
  run.Feed(3);
  EXPECT_FALSE(run.map.map().IsRegistered(4));
  EXPECT_EQ(run.events.back().refusal.text, "pose badly determined by its inliers")
      << run.events.back().num_visible << " points";
}

}  // namespace skein::submap_registration_test
