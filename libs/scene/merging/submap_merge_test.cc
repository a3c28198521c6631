#include "merging/submap_merge.h"

#include <gtest/gtest.h>

#include "merging/fuse.h"
#include "testing/submap_rig.h"

namespace skein::submap_merge_test {

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

// A target with 13 of 16 photos, and a source with all of them.
class SubmapMergeTest : public testing::Test {
 protected:
  static SyntheticOptions Options() {
    SyntheticOptions options;
    options.num_photos = 16;
    return options;
  }
  void SetUp() override {
    SubmapRig whole(Options());
    whole.FeedAll();
    source_ = whole.map.map().reconstruction();
    FeedFirst(13, &target_);
  }
  // With the similarity as it is, but for a factor of its scale.
  MergeOrder Ordered(double scale_factor) const {
    const Reconstruction& target = target_.map.map().reconstruction();
    const Sim3Result found = EstimateSim3(SharedPhotosOf(source_, target), {});
    EXPECT_TRUE(found.success) << found.reason;
    MergeOrder order;
    order.target_from_source = found.target_from_source;
    order.target_from_source->scale *= scale_factor;
    order.num_agreeing = static_cast<int>(found.inlier_image_ids.size());
    order.keeps_frames = true;
    return order;
  }

  SubmapRig target_{Options()};
  Reconstruction source_;
};

TEST_F(SubmapMergeTest, GoesOnFromTheOrdersSimilarity) {
  const Absorption absorption = AbsorbIntoSubmap(source_, Ordered(1), &target_.map);
  ASSERT_TRUE(absorption.status.ok()) << absorption.status.error();
  EXPECT_EQ(target_.NumRegistered(), 16);
  ASSERT_NE(absorption.before, nullptr);
  EXPECT_EQ(absorption.before->NumRegImages(), 13u);
  EXPECT_EQ(absorption.events.size(), 3u);
}

TEST_F(SubmapMergeTest, EstimatesASimilarityAnewThatDoesNotHold) {
  const Absorption absorption = AbsorbIntoSubmap(source_, Ordered(3), &target_.map);
  ASSERT_TRUE(absorption.status.ok()) << absorption.status.error();
  EXPECT_LT(target_.PositionErrorPercent(), 0.3);
}

// Photos 9 to 13 are shared, and 14 to 16 are guests of the source meanwhile.
TEST_F(SubmapMergeTest, AFailedMergeLeavesTheTargetAsItWas) {
  for (ImageId id = 1; id <= 8; ++id) source_.DeRegisterImage(id);
  const size_t num_points = target_.map.map().reconstruction().NumPoints3D();
  MergeOrder order;
  order.min_shared_images = 9;
  const Absorption absorption = AbsorbIntoSubmap(source_, order, &target_.map);
  EXPECT_FALSE(absorption.status.ok());
  EXPECT_EQ(absorption.before, nullptr);
  EXPECT_EQ(target_.NumRegistered(), 13);
  EXPECT_EQ(target_.map.map().reconstruction().NumPoints3D(), num_points);
}

// With 13 shared photos the target takes in no guests, so the merged model does not know photo 16.
TEST_F(SubmapMergeTest, APhotoWhoseCameraWentAstrayInTheSourceIsLeftOut) {
  LeadCameraAstray(16, &source_);
  const Absorption absorption = AbsorbIntoSubmap(source_, MergeOrder(), &target_.map);
  ASSERT_TRUE(absorption.status.ok()) << absorption.status.error();
  EXPECT_EQ(target_.NumRegistered(), 15);
  EXPECT_FALSE(target_.map.map().IsRegistered(16));
  EXPECT_LT(target_.PositionErrorPercent(), 0.3);
}

}  // namespace skein::submap_merge_test
