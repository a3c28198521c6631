#include "sfm/camera.h"

#include <gtest/gtest.h>

#include <stdexcept>

namespace skein::camera_test {

Camera Radial() {
  Camera camera;
  camera.InitializeWithName("SIMPLE_RADIAL", 500, 640, 480);
  camera.Params(3) = 0.1;
  return camera;
}

TEST(Camera, HasThePrincipalPointInTheMiddleAtFirst) {
  const Camera camera = Radial();
  EXPECT_EQ(camera.ModelId(), kSimpleRadial);
  EXPECT_EQ(camera.ModelName(), "SIMPLE_RADIAL");
  EXPECT_EQ(camera.PrincipalPointX(), 320);
  EXPECT_EQ(camera.PrincipalPointY(), 240);
  EXPECT_EQ(camera.MeanFocalLength(), 500);
  EXPECT_TRUE(camera.VerifyParams());
}

TEST(Camera, ProjectsByItsModel) {
  const Eigen::Vector2d pixel = Radial().WorldToImage({0.2, -0.1});
  const double distortion = 1 + 0.1 * (0.04 + 0.01);
  EXPECT_NEAR(pixel.x(), 500 * 0.2 * distortion + 320, 1e-9);
  EXPECT_NEAR(pixel.y(), -500 * 0.1 * distortion + 240, 1e-9);
}

TEST(Camera, UndoesItsProjectionForEveryModel) {
  for (int id = 0; ExistsCameraModel(id); ++id) {
    Camera camera;
    camera.InitializeWithId(id, 500, 640, 480);
    for (const size_t i : camera.ExtraParamsIdxs()) camera.Params(i) = 0.01;
    const Eigen::Vector2d on_plane(0.2, -0.1);
    EXPECT_LT((camera.ImageToWorld(camera.WorldToImage(on_plane)) - on_plane).norm(), 1e-6)
        << camera.ModelName();
  }
}

TEST(Camera, IsBogusOutsideOfTheLimits) {
  Camera camera = Radial();
  EXPECT_FALSE(camera.HasBogusParams(0.1, 10, 1));
  EXPECT_TRUE(camera.HasBogusParams(1, 10, 1));    // 500 / 640 < 1
  EXPECT_TRUE(camera.HasBogusParams(0.1, 10, 0));  // 0.1 > 0
  camera.SetPrincipalPointX(-1);
  EXPECT_TRUE(camera.HasBogusParams(0.1, 10, 1));
}

TEST(Camera, RescalesWithThePhoto) {
  Camera camera = Radial();
  camera.Rescale(320, 240);
  EXPECT_EQ(camera.MeanFocalLength(), 250);
  EXPECT_EQ(camera.PrincipalPointX(), 160);
  EXPECT_EQ(camera.Params(3), 0.1);
}

TEST(Camera, RefusesAModelThatDoesNotExist) {
  EXPECT_FALSE(ExistsCameraModel("WIDE"));
  EXPECT_FALSE(ExistsCameraModel(-1));
  EXPECT_THROW(CameraModelId("WIDE"), std::invalid_argument);
  EXPECT_THROW(Camera().MeanFocalLength(), std::invalid_argument);
  EXPECT_FALSE(AreParamsOfModel(kSimpleRadial, {1, 2}));
  EXPECT_FALSE(AreParamsOfModel(1000, {1, 2}));
}

}  // namespace skein::camera_test
