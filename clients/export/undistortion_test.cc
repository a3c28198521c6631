#include "clients/export/undistortion.h"

#include <gtest/gtest.h>

#include <opencv2/imgproc.hpp>

namespace skein::undistortion_test {

Camera MakeCamera(const std::string& model, const std::vector<double>& params) {
  Camera camera;
  camera.SetCameraId(7);
  camera.SetModelIdFromName(model);
  camera.SetWidth(640);
  camera.SetHeight(480);
  camera.SetParams(params);
  return camera;
}

// Lens models from a pincushion to a fisheye, one of them with the principal point off the middle.
std::vector<Camera> Lenses() {
  return {MakeCamera("SIMPLE_RADIAL", {500, 320, 240, -0.1}),
          MakeCamera("SIMPLE_RADIAL", {500, 320, 240, 0.1}),
          MakeCamera("RADIAL", {450, 320, 240, -0.2, 0.05}),
          MakeCamera("OPENCV", {500, 480, 300, 250, -0.12, 0.02, 0.002, -0.001}),
          MakeCamera("OPENCV_FISHEYE", {400, 420, 320, 240, -0.02, 0.003, -0.004, 0.005}),
          MakeCamera("SIMPLE_RADIAL_FISHEYE", {300, 320, 240, 0.02}),
          MakeCamera("FOV", {400, 400, 320, 240, 0.8})};
}

TEST(Undistortion, LeavesAPinholeAsItIs) {
  const auto undistortion = Undistortion::Of(MakeCamera("PINHOLE", {500, 510, 320, 240}));
  ASSERT_TRUE(undistortion.ok());
  EXPECT_EQ(undistortion->camera().Params(), (std::vector<double>{500, 510, 320, 240}));
  EXPECT_EQ(undistortion->camera().Width(), 640u);
  EXPECT_EQ(undistortion->camera().Height(), 480u);
  cv::Mat3b photo(480, 640);
  cv::randu(photo, 0, 255);
  EXPECT_EQ(cv::norm(undistortion->Apply(photo), photo, cv::NORM_INF), 0);
}

TEST(Undistortion, PutsThePrincipalPointIntoTheMiddle) {
  const auto undistortion = Undistortion::Of(MakeCamera("PINHOLE", {500, 500, 300, 250}));
  ASSERT_TRUE(undistortion.ok());
  EXPECT_EQ(undistortion->camera().Width(), 600u);
  EXPECT_EQ(undistortion->camera().Height(), 460u);
  EXPECT_EQ(undistortion->camera().Params(), (std::vector<double>{500, 500, 300, 230}));
  EXPECT_EQ(undistortion->Apply(Eigen::Vector2d(310, 260)), Eigen::Vector2d(310, 240));
}

TEST(Undistortion, LeavesNoBorderAndWastesLittle) {
  const cv::Mat3b white(480, 640, cv::Vec3b::all(255));
  for (const Camera& camera : Lenses()) {
    SCOPED_TRACE(camera.ModelName());
    EXPECT_FALSE(Undistortion::MayHaveBorders(camera));
    const auto undistortion = Undistortion::Of(camera);
    ASSERT_TRUE(undistortion.ok());
    EXPECT_EQ(undistortion->camera().ModelName(), "PINHOLE");
    EXPECT_EQ(undistortion->camera().CameraId(), 7u);
    EXPECT_FALSE(undistortion->has_borders());
    double least = 0;
    cv::minMaxLoc(undistortion->Apply(white).reshape(1), &least);
    EXPECT_EQ(least, 255);
    // One more pixel at each side, and the nearer border of the photo is passed.
    const Camera& pinhole = undistortion->camera();
    const double width = static_cast<double>(pinhole.Width());
    const double height = static_cast<double>(pinhole.Height());
    double nearest = HUGE_VAL;
    for (double y = 0; y <= height; ++y) {
      for (const double x : {-1.0, width + 1}) {
        const double px = camera.WorldToImage(pinhole.ImageToWorld(Eigen::Vector2d(x, y))).x();
        nearest = std::min({nearest, px, 640 - px});
      }
    }
    EXPECT_LT(nearest, 0);
  }
}

// A point's pixel in the photo, and that of the same direction in the undistorted one.
TEST(Undistortion, MovesPixelsAndPointsAlike) {
  for (const Camera& camera : Lenses()) {
    SCOPED_TRACE(camera.ModelName());
    const auto undistortion = Undistortion::Of(camera);
    ASSERT_TRUE(undistortion.ok());
    for (const Eigen::Vector2d& point :
         {Eigen::Vector2d(320.5, 240.5), Eigen::Vector2d(120.5, 90.5),
          Eigen::Vector2d(500.5, 400.5)}) {
      cv::Mat3b photo(480, 640, cv::Vec3b::all(0));
      cv::circle(photo, cv::Point2d(point.x() - 0.5, point.y() - 0.5), 5, cv::Scalar::all(255), -1,
                 cv::LINE_AA);
      cv::Mat1b grey;
      cv::cvtColor(undistortion->Apply(photo), grey, cv::COLOR_BGR2GRAY);
      const cv::Moments moments = cv::moments(grey);
      const Eigen::Vector2d found(moments.m10 / moments.m00 + 0.5, moments.m01 / moments.m00 + 0.5);
      // A fisheye moves the middle of a disc off its centre, too.
      EXPECT_LT((found - undistortion->Apply(point)).norm(), 0.3) << point.transpose();
    }
  }
}

// k = -0.4: beyond a radius of 0.91 focal lengths the polynomial turns back.
TEST(Undistortion, MasksWhatTheLensModelDoesNotReach) {
  const Camera camera = MakeCamera("SIMPLE_RADIAL", {250, 320, 240, -0.4});
  EXPECT_TRUE(Undistortion::MayHaveBorders(camera));
  const auto undistortion = Undistortion::Of(camera);
  ASSERT_TRUE(undistortion.ok());
  EXPECT_TRUE(undistortion->has_borders());
  const cv::Mat1b& mask = undistortion->mask();
  const double radius_px = 250 * std::sqrt(1 / (3 * 0.4));
  EXPECT_NEAR(mask.cols / 2.0, radius_px, 2);
  EXPECT_EQ(mask(mask.rows / 2, mask.cols / 2), 255);
  EXPECT_EQ(mask(0, 0), 0);
  for (int y = 0; y < mask.rows; ++y) {
    for (int x = 0; x < mask.cols; ++x) {
      const double radius = std::hypot(x + 0.5 - mask.cols / 2.0, y + 0.5 - mask.rows / 2.0);
      if (radius > radius_px + 2) {
        EXPECT_EQ(mask(y, x), 0) << x << " " << y;
      }
    }
  }
  const cv::Mat3b white(480, 640, cv::Vec3b::all(255));
  const cv::Mat3b photo = undistortion->Apply(white);
  EXPECT_EQ(photo(0, 0), cv::Vec3b(0, 0, 0));
  EXPECT_EQ(photo(mask.rows / 2, mask.cols / 2), cv::Vec3b(255, 255, 255));
}

TEST(Undistortion, RefusesAbsurdParameters) {
  const double nan = std::nan("");
  for (const auto& params :
       {std::vector<double>{500, 320, 240, nan}, {nan, 320, 240, 0}, {500, 320, 240, -1e9}}) {
    EXPECT_FALSE(Undistortion::Of(MakeCamera("SIMPLE_RADIAL", params)).ok()) << params.back();
  }
}

TEST(Undistortion, WantsThePhotoInTheCamerasSize) {
  const auto undistortion = Undistortion::Of(MakeCamera("SIMPLE_RADIAL", {500, 320, 240, -0.1}));
  EXPECT_THROW(undistortion->Apply(cv::Mat3b(240, 320)), std::invalid_argument);
}

}  // namespace skein::undistortion_test
