#include "mapping/own_cameras.h"

#include <gtest/gtest.h>

#include <memory>
#include <vector>

#include "testing/submap_rig.h"

namespace skein::own_cameras_test {

// A finished map of photos without EXIF.
std::unique_ptr<SceneMap> MapOf(const std::vector<int>& zoomed_photos) {
  SyntheticOptions options;
  options.num_photos = 16;
  options.focal_from_exif = false;
  options.zoomed_photos = zoomed_photos;
  SubmapRig run(options);
  run.FeedAll();
  run.map.Finish(run.Sink());
  return run.map.map().Clone();
}

TEST(ShareCamerasAgain, APhotoOfTheCameraThatWasTakenForAnother) {
  const std::unique_ptr<SceneMap> map = MapOf({});
  std::vector<double> params = map->reconstruction().Camera(1).Params();
  params[0] *= 0.97;
  map->GiveOwnCamera(6);
  map->SetCamera(SceneMap::OwnCamera(6), params);
  EXPECT_TRUE(ShareCamerasAgain({}, map.get()));
  EXPECT_EQ(map->reconstruction().Image(6).CameraId(), 1u);
  EXPECT_EQ(map->camera_state(1).num_registered, 16);
  EXPECT_EQ(map->camera_state(SceneMap::OwnCamera(6)).num_registered, 0);
  EXPECT_FALSE(ShareCamerasAgain({}, map.get()));
}

TEST(ShareCamerasAgain, NotAPhotoThatWasZoomed) {
  const std::unique_ptr<SceneMap> map = MapOf({5, 11});
  ASSERT_EQ(map->reconstruction().Image(6).CameraId(), SceneMap::OwnCamera(6));
  EXPECT_FALSE(ShareCamerasAgain({}, map.get()));
  EXPECT_EQ(map->reconstruction().Image(6).CameraId(), SceneMap::OwnCamera(6));
}

}  // namespace skein::own_cameras_test
