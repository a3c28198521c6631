#include "mapping/local_adjustment.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "testing/synthetic_scene.h"

namespace skein::local_adjustment_test {

TEST(LocalWindow, TakesTheImagesWithMostPointsInCommon) {
  SyntheticOptions scene_options;
  scene_options.num_photos = 16;
  const SyntheticScene scene = MakeScene(scene_options);
  SceneMap map;
  FillMap(scene, &map);
  const BundleRequest request = SelectLocalWindow(map, 16, 6);
  ASSERT_EQ(request.free.size(), 4u);
  ASSERT_EQ(request.held.size(), 2u);
  EXPECT_TRUE(request.hold_open_points);
  std::set<ImageId> window(request.free.begin(), request.free.end());
  window.insert(request.held.begin(), request.held.end());
  const std::vector<Point3DId> points = PointsSeenBy(map, {16});
  size_t fewest = points.size();
  for (const ImageId id : window) fewest = std::min(fewest, NumSeen(map, points, id));
  for (ImageId id = 1; id <= 16; ++id) {
    if (window.count(id) > 0) continue;
    EXPECT_LE(NumSeen(map, points, id), fewest) << "image " << id;
  }
  EXPECT_EQ(request.complete_points, WithoutLongTracks(map, points));
  std::vector<Point3DId> all = request.points;
  all.insert(all.end(), request.complete_points.begin(), request.complete_points.end());
  std::sort(all.begin(), all.end());
  EXPECT_EQ(all, PointsSeenBy(map, request.free));
}

// One that takes in the whole map leaves two photos where they are, for the gauge.
TEST(LocalWindow, HoldsTwoImagesOfASmallMap) {
  const SyntheticScene scene = MakeScene({});
  SceneMap map;
  FillMap(scene, &map);
  const BundleRequest request = SelectLocalWindow(map, 8, 30);
  EXPECT_EQ(request.free.size(), 6u);
  EXPECT_EQ(request.held.size(), 2u);
}

}  // namespace skein::local_adjustment_test
