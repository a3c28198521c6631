#include "merging/fuse.h"

#include <gtest/gtest.h>

#include "merging/seam_bundle.h"
#include "sfm/camera_fit.h"
#include "testing/synthetic_submaps.h"

namespace skein::fuse_test {

class FuseTest : public testing::Test {
 protected:
  const Similarity gauge_{2.0, Eigen::Quaterniond(1, 0.3, -0.5, 0.2).normalized(), {5, -2, 8}};
  const SyntheticWorld world_{WallOptions(), 1};
  const Reconstruction target_ = world_.Submap(1, 8, Similarity(), 1.0);
  const Reconstruction source_ = world_.Submap(6, 12, gauge_, 1.0);
};

TEST_F(FuseTest, SharedPhotosAreThoseRegisteredInBothModels) {
  std::vector<int64_t> ids;
  for (const SharedPhoto& photo : SharedPhotosOf(source_, target_)) ids.push_back(photo.image_id);
  EXPECT_EQ(ids, (std::vector<int64_t>{6, 7, 8}));
}

TEST_F(FuseTest, OneStructureInTheTargetsFrame) {
  const Sim3Result found = EstimateSim3(SharedPhotosOf(source_, target_), {});
  ASSERT_TRUE(found.success) << found.reason;
  Reconstruction merged = target_;
  const FuseResult fused = FuseModels(source_, found.target_from_source, {}, &merged);
  EXPECT_TRUE(fused.status.ok()) << fused.status.error();
  EXPECT_EQ(fused.agreeing, (std::set<ImageId>{6, 7, 8}));
  EXPECT_EQ(fused.added, (std::set<ImageId>{9, 10, 11, 12}));
  EXPECT_GT(fused.num_fused_points, 0.9 * fused.num_common_points);
  EXPECT_EQ(merged.NumPoints3D(), target_.NumPoints3D() + fused.num_added_points);
  EXPECT_EQ(merged.Image(2).ProjectionCenter(), target_.Image(2).ProjectionCenter());
}

// Each submap chooses a camera's model by its own photos (mapping/camera_models.h).
TEST_F(FuseTest, ACameraHasTheModelOfTheSubmapWithMorePhotosOfIt) {
  Reconstruction source = source_;
  source.Camera(1) = FitCameraModel(source.Camera(1), kOpenCv);
  const auto fuse = [](const Reconstruction& from, Reconstruction to) {
    const Sim3Result found = EstimateSim3(SharedPhotosOf(from, to), {});
    const FuseResult fused = FuseModels(from, found.target_from_source, {}, &to);
    EXPECT_EQ(fused.agreeing, (std::set<ImageId>{6, 7, 8}));
    return to.Camera(1);
  };
  EXPECT_EQ(fuse(source, target_).Params(), target_.Camera(1).Params());  // 7 photos, and 8
  const Camera kept = fuse(target_, source);
  EXPECT_EQ(kept.ModelId(), target_.Camera(1).ModelId());
  EXPECT_EQ(kept.Params(), target_.Camera(1).Params());
}

TEST_F(FuseTest, ASeamsBundleHoldsWhatIsNotOfIt) {
  Reconstruction model = target_;
  for (const ImageId id : {4, 5})
    model.Image(id).SetTvec(model.Image(id).Tvec() + Eigen::Vector3d(0.05, 0, 0));
  SeamIntrinsics never;
  never.min_images = 10;
  const BundleSummary summary = AdjustSeam({4, 5}, never, &model);
  ASSERT_TRUE(summary.usable);
  EXPECT_EQ(summary.num_free_poses, 2);
  EXPECT_LT(summary.final_cost, 0.5 * summary.initial_cost);
  EXPECT_EQ(model.Image(1).Tvec(), target_.Image(1).Tvec());
  EXPECT_EQ(model.Camera(1).Params(), target_.Camera(1).Params());
  EXPECT_LT((model.Image(4).ProjectionCenter() - target_.Image(4).ProjectionCenter()).norm(), 0.01);
}

}  // namespace skein::fuse_test
