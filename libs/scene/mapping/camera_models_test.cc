#include "mapping/camera_models.h"

#include <gtest/gtest.h>

#include <limits>
#include <string>
#include <vector>

#include "core/statistics.h"
#include "map/bundle_builder.h"
#include "mapping/checkpoint.h"
#include "sfm/camera_fit.h"
#include "testing/submap_rig.h"

namespace skein::camera_models_test {

constexpr CameraId kCamera = 1;

// Photos of a wall that fills them, with an angle of view of 100 degrees.
SyntheticOptions WidePhotos() {
  SyntheticOptions options;
  options.shape = SyntheticOptions::Shape::kWall;
  options.num_points = 2000;
  options.num_photos = 14;
  options.camera.focal_px = 500;
  return options;
}

// The same photos, taken with another lens.
void TakeWith(const std::string& model, const std::vector<double>& params,
              const SyntheticCamera& taken, SyntheticScene* scene) {
  Camera before, lens;
  before.InitializeWithName("SIMPLE_PINHOLE", taken.focal_px, taken.width_px, taken.height_px);
  lens.InitializeWithName(model, taken.focal_px, taken.width_px, taken.height_px);
  lens.SetParams(params);
  for (PhotoInput& photo : scene->photos) {
    for (Keypoint& keypoint : photo.keypoints) {
      const Eigen::Vector2d pixel =
          lens.WorldToImage(before.ImageToWorld(Eigen::Vector2d(keypoint.x, keypoint.y)));
      keypoint.x = static_cast<float>(pixel.x());
      keypoint.y = static_cast<float>(pixel.y());
    }
  }
}

struct Lens {
  std::string model;
  std::vector<double> params;
};

const Lens kActionCamera{"OPENCV", {500, 500, 600, 450, -0.24, 0.06, 0, 0}};
const Lens kSqueezed{"OPENCV", {520, 480, 600, 450, 0.01, 0, 0.002, -0.003}};
const Lens kFisheye{"OPENCV_FISHEYE", {560, 560, 600, 450, 0.01, 0, 0, 0}};

class CameraModels : public testing::Test {
 protected:
  // A finished map of photos that were taken with the lens.
  SubmapRig& Map(const Lens& lens, const SubmapOptions& submap = {}) {
    const SyntheticOptions options = WidePhotos();
    rig_.emplace(options, submap);
    TakeWith(lens.model, lens.params, options.camera, &rig_->scene);
    rig_->FeedAll();
    rig_->map.Finish(rig_->Sink());
    return *rig_;
  }
  const Camera& MappedCamera() const { return rig_->map.map().reconstruction().Camera(kCamera); }

 private:
  std::optional<SubmapRig> rig_;
};

TEST_F(CameraModels, EachLensGetsTheModelThatItIsOf) {
  for (const Lens& lens : {kActionCamera, kSqueezed, kFisheye}) {
    const SubmapRig& rig = Map(lens);
    EXPECT_EQ(rig.NumRegistered(), 14) << lens.model;
    EXPECT_EQ(MappedCamera().ModelName(), lens.model);
    EXPECT_LT(rig.PositionErrorPercent(), 0.1) << lens.model;
    EXPECT_EQ(MappedCamera().HasTwoEqualFocalLengths(), lens.params[0] == lens.params[1]);
    for (size_t i = 0; i < lens.params.size(); ++i) {
      EXPECT_NEAR(MappedCamera().Params(i), lens.params[i], lens.params[i] > 1 ? 1 : 0.01)
          << lens.model << ", parameter " << i;
    }
  }
}

// One of two cameras gets another model.
TEST_F(CameraModels, ACameraThatKeepsItsModelKeepsItsParameters) {
  const SyntheticOptions options = WidePhotos();
  SubmapRig rig(options);
  TakeWith(kActionCamera.model, kActionCamera.params, options.camera, &rig.scene);
  for (PhotoInput& photo : rig.scene.photos) photo.camera_id = 1 + photo.image_id % 2;
  rig.FeedAll();
  rig.map.Finish(rig.Sink());
  SceneMap& map = rig.map.map();
  for (const ImageId id : {13, 14}) map.Deregister(id);
  const auto error_px = [&] {
    return UpperMedian(ReprojectionErrors(BuildGlobalBundle(map, false)));
  };
  const double error_before_px = error_px();
  map.SetCamera(FitCameraModel(map.reconstruction().Camera(2), kSimpleRadial));
  EXPECT_TRUE(ChooseCameraModels(BundleOptions(), &map));
  EXPECT_LE(error_px(), error_before_px);
  for (const CameraId id : {1, 2}) {
    const Camera& camera = map.reconstruction().Camera(id);
    ASSERT_EQ(camera.ModelId(), kOpenCv) << id;
    EXPECT_NEAR(camera.Params(0), 500, 1) << id;
    EXPECT_NEAR(camera.Params(4), kActionCamera.params[4], 0.01) << id;
  }
}

TEST_F(CameraModels, ASimpleLensStaysSimple) {
  Map({"SIMPLE_RADIAL", {500, 600, 450, -0.05}});
  EXPECT_EQ(MappedCamera().ModelName(), "SIMPLE_RADIAL");
}

TEST_F(CameraModels, AModelThatAPersonNamesStays) {
  SubmapOptions submap;
  submap.camera_model = "SIMPLE_RADIAL";
  const SubmapRig& rig = Map(kActionCamera, submap);
  EXPECT_EQ(MappedCamera().ModelName(), "SIMPLE_RADIAL");
  EXPECT_GT(rig.PositionErrorPercent(), 0.1);
}

TEST_F(CameraModels, ACheckpointKeepsThem) {
  SubmapRig& rig = Map(kFisheye);
  SubmapRig restored(WidePhotos());
  restored.scene = rig.scene;
  for (size_t i = 0; i < rig.scene.photos.size(); ++i) restored.Add(i);
  ASSERT_TRUE(RestoreSubmap(SaveSubmap(&rig.map), &restored.map).ok());
  const Camera& camera = restored.map.map().reconstruction().Camera(kCamera);
  EXPECT_EQ(camera.ModelId(), kOpenCvFisheye);
  EXPECT_EQ(camera.Params(), MappedCamera().Params());
  // Its prior is one of that model.
  EXPECT_EQ(restored.map.map().camera_state(kCamera).prior_params.size(), camera.NumParams());
}

// Each photo's intrinsics are of the simple model, where one lens for all of them does not fit.
TEST_F(CameraModels, PhotosOfTheirOwnCamerasHaveTheSimpleOne) {
  SubmapRig& rig = Map(kActionCamera);
  SceneMap& map = rig.map.map();
  map.GiveOwnCamera(5);
  const Camera& own = map.reconstruction().Camera(SceneMap::OwnCamera(5));
  EXPECT_EQ(own.ModelName(), "SIMPLE_RADIAL");
  EXPECT_EQ(own.Params(0), 500);
}

TEST_F(CameraModels, WithoutPhotosACameraIsAsItCame) {
  SubmapRig& rig = Map(kFisheye);
  SceneMap& map = rig.map.map();
  for (ImageId id = 1; id <= 14; ++id) map.Deregister(id);
  EXPECT_EQ(MappedCamera().ModelName(), "SIMPLE_RADIAL");
  EXPECT_EQ(map.camera_state(kCamera).prior_params, MappedCamera().Params());
}

// A map that was settled in the background, before anything was chosen.
TEST_F(CameraModels, AFinishChoosesThemForASettledMap) {
  const SyntheticOptions options = WidePhotos();
  SubmapOptions submap;
  submap.background = true;
  submap.max_images_all_global = 2;
  SubmapRig rig(options, submap);
  TakeWith(kFisheye.model, kFisheye.params, options.camera, &rig.scene);
  rig.FeedAll();
  while (rig.map.Maintain(std::numeric_limits<double>::infinity(), rig.Sink())) continue;
  const Camera& camera = rig.map.map().reconstruction().Camera(kCamera);
  EXPECT_EQ(camera.ModelId(), kSimpleRadial);
  rig.map.Finish(rig.Sink());
  EXPECT_EQ(camera.ModelId(), kOpenCvFisheye);
  EXPECT_LT(rig.PositionErrorPercent(), 0.1);
}

// A person knows this lens, and leaves its parameters to be refined.
TEST_F(CameraModels, AKnownModelStays) {
  const SyntheticOptions options = WidePhotos();
  SubmapRig rig(options);
  TakeWith(kFisheye.model, kFisheye.params, options.camera, &rig.scene);
  for (PhotoInput& photo : rig.scene.photos) {
    photo.camera_model = "RADIAL";
    photo.camera_params = {500, 600, 450, 0, 0};
  }
  rig.FeedAll();
  rig.map.Finish(rig.Sink());
  EXPECT_EQ(rig.map.map().reconstruction().Camera(kCamera).ModelName(), "RADIAL");
  Reconstruction other = rig.map.map().reconstruction();
  other.Camera(kCamera).SetModelId(kOpenCv);
  EXPECT_FALSE(rig.map.ReplaceModel(other).ok());
}

}  // namespace skein::camera_models_test
