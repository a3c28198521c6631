#include "mapper/absorb_source.h"

#include <gtest/gtest.h>

#include "sfm/model_io.h"
#include "testing/submap_rig.h"

namespace skein::absorb_source_test {

// The photo gets a camera of its own, with a focal length that no camera has.
void LeadCameraAstray(ImageId id, Reconstruction* model) {
  Camera camera = model->Camera(model->Image(id).CameraId());
  camera.SetCameraId(SceneMap::OwnCamera(id));
  camera.SetFocalLength(1000 * camera.MeanFocalLength());
  model->AddCamera(camera);
  model->Image(id).SetCameraId(camera.CameraId());
}

// Registers photos 1 to `last`; the others are there.
void FeedFirst(size_t last, SubmapRig* run) {
  ASSERT_TRUE(run->Start(0, 2));
  for (size_t i = last; i < run->scene.photos.size(); ++i) run->map.SetHeldElsewhere(i + 1, true);
  for (size_t i = 0; i < run->scene.photos.size(); ++i) {
    if (i != 0 && i != 2) run->Feed(i);
  }
  ASSERT_EQ(run->NumRegistered(), static_cast<int>(last));
}

// With 13 shared photos the target takes in no guests, so the merged model does not know photo 16.
TEST(AbsorbSource, APhotoWhoseCameraWentAstrayInTheSourceIsLeftOut) {
  SyntheticOptions options;
  options.num_photos = 16;
  SubmapRig whole(options), target(options);
  whole.FeedAll();
  FeedFirst(13, &target);
  Reconstruction source = whole.map.map().reconstruction();
  LeadCameraAstray(16, &source);
  MergeTask task{};
  task.order.num_shared_images = 3;
  const Absorption absorption = AbsorbSource(EncodeModel(source), task, &target.map);
  ASSERT_TRUE(absorption.status.ok()) << absorption.status.error();
  EXPECT_EQ(target.NumRegistered(), 15);
  EXPECT_FALSE(target.map.map().IsRegistered(16));
  EXPECT_LT(target.PositionErrorPercent(), 0.3);
}

}  // namespace skein::absorb_source_test
