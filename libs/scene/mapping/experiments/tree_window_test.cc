#include "mapping/experiments/tree_window.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "testing/synthetic_scene.h"

namespace skein::tree_window_test {

// A long chain: the photos at its ends share their points with few others.
TEST(TreeWindow, EachFreeImageHasItsShareOfThePointsOverTheLimit) {
  SyntheticOptions scene_options;
  scene_options.path = SyntheticOptions::Path::kForward;
  scene_options.num_photos = 16;
  scene_options.num_points = 4000;
  const SyntheticScene scene = MakeScene(scene_options);
  SceneMap map;
  FillMap(scene, &map);
  TreeWindow window(TreeForm::kConsistent, 400);
  for (uint32_t id = 2; id <= 16; ++id) {
    for (uint32_t before = 1; before <= 4 && before < id; ++before) {
      window.AddSimilar(id, {{id - before, 0.5}});
    }
  }
  const BundleRequest request = window.SelectWindow(map, 16);
  EXPECT_EQ(request.points.size(), 400u);
  ASSERT_GE(request.free.size(), 10u);
  const size_t share = (400 - 200) / (request.free.size() - 1);
  EXPECT_GE(NumSeen(map, request.points, 16), 200u);
  for (const ImageId id : request.free) {
    EXPECT_GE(NumSeen(map, request.points, id), share) << "image " << id;
  }
}

TEST(TreeWindow, TakesAllPointsWithinTheLimit) {
  const SyntheticScene scene = MakeScene({});
  SceneMap map;
  FillMap(scene, &map);
  TreeWindow window(TreeForm::kConsistent);
  for (uint32_t id = 2; id <= 8; ++id) window.AddSimilar(id, {{id - 1, 0.5}, {1, 0.5}});
  const BundleRequest request = window.SelectWindow(map, 8);
  EXPECT_EQ(request.points.size(), map.reconstruction().NumPoints3D());
}

}  // namespace skein::tree_window_test
