#include "sfm/camera_fit.h"

#include <gtest/gtest.h>

#include <string>

namespace skein::camera_fit_test {

Camera MakeCamera(const std::string& model, const std::vector<double>& params) {
  Camera camera;
  camera.InitializeWithName(model, 1, 640, 480);
  camera.SetParams(params);
  return camera;
}

// Over the photo, of pixels that both cameras know.
double LargestDifferencePx(const Camera& a, const Camera& b) {
  double largest = 0;
  for (double y = 40; y < 480; y += 80) {
    for (double x = 40; x < 640; x += 80) {
      const Eigen::Vector2d pixel(x, y);
      largest = std::max(largest, (b.WorldToImage(a.ImageToWorld(pixel)) - pixel).norm());
    }
  }
  return largest;
}

double DifferenceAfterFit(const Camera& camera, const std::string& model) {
  return LargestDifferencePx(camera, FitCameraModel(camera, CameraModelId(model)));
}

TEST(CameraFit, IsExactWhereTheOtherModelIsMoreGeneral) {
  const Camera simple = MakeCamera("SIMPLE_RADIAL", {500, 330, 235, -0.1});
  for (const char* model : {"RADIAL", "OPENCV", "FULL_OPENCV"}) {
    EXPECT_LT(DifferenceAfterFit(simple, model), 1e-6) << model;
  }
}

TEST(CameraFit, ComesCloseToALensOfAnotherKind) {
  const Camera fisheye = MakeCamera("OPENCV_FISHEYE", {400, 400, 320, 240, 0, 0, 0, 0});
  EXPECT_LT(DifferenceAfterFit(fisheye, "OPENCV"), 2);
  EXPECT_LT(DifferenceAfterFit(MakeCamera("RADIAL", {450, 320, 240, -0.2, 0.03}), "OPENCV_FISHEYE"),
            1);
}

TEST(CameraFit, KeepsThePrincipalPointAndPixelsThatAreNotSquare) {
  const Camera squeezed = MakeCamera("PINHOLE", {500, 450, 300, 250});
  const std::vector<double> params = FitCameraModel(squeezed, kOpenCv).Params();
  EXPECT_NEAR(params[0], 500, 1e-6);
  EXPECT_NEAR(params[1], 450, 1e-6);
  EXPECT_EQ(params[2], 300);
  EXPECT_EQ(params[3], 250);
}

// A wide fisheye is far from any radial lens. What comes is one nevertheless.
TEST(CameraFit, GivesAPossibleLensWhereNoneIsNear) {
  const Camera fisheye =
      MakeCamera("OPENCV_FISHEYE", {300, 300, 320, 240, 0, 0, 0, 0});  // 150 degrees
  EXPECT_FALSE(FitCameraModel(fisheye, kSimpleRadial).HasBogusParams(0.1, 10, 1));
}

// Beyond the largest radius of such a distortion no ray meets the photo.
TEST(CameraFit, LeavesOutPixelsWithoutARay) {
  const Camera folded = MakeCamera("SIMPLE_RADIAL", {300, 320, 240, -0.4});
  const Camera fitted = FitCameraModel(folded, kOpenCv);
  for (const double param : fitted.Params()) EXPECT_TRUE(std::isfinite(param));
}

}  // namespace skein::camera_fit_test
