#include "clients/places/effects.h"

#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/imgproc.hpp>

#include "clients/places/render.h"
#include "testing/test_plate.h"

namespace skein::sim {
namespace effects_test {

const Camera kCamera{640, 480, 550, -0.06};

// Light of PlateBeforeWall: 0 at the wall, 1 at the plate.
cv::Mat1f Plate(const cv::Mat3f& light) {
  cv::Mat1f grey;
  cv::extractChannel(light, grey, 1);
  double wall = 0, plate = 0;
  cv::minMaxLoc(grey, &wall, &plate);
  return (grey - wall) / (plate - wall);
}

Eigen::Vector2d Centroid(const cv::Mat1f& image) {
  const cv::Moments m = cv::moments(image);
  return {m.m10 / m.m00 + 0.5, m.m01 / m.m00 + 0.5};
}

Eigen::Vector2d Projected(const Pose& pose, const Eigen::Vector3f& point) {
  Eigen::Vector2d pixel;
  EXPECT_TRUE(Project(kCamera, pose, point.cast<double>(), &pixel));
  return pixel;
}

TEST(BlurAlong, EdgeBecomesARampAsWideAsTheMotion) {
  cv::Mat3f light(4, 100, cv::Vec3f(0, 0, 0));
  light.colRange(50, 100).setTo(cv::Scalar::all(100));
  const cv::Mat3f blurred = BlurAlong(light, cv::Mat2f(light.size(), cv::Vec2f(8, 0)));
  int ramp = 0;
  for (int x = 0; x < light.cols; ++x) {
    const double beyond = std::clamp((x + 0.5 + 4 - 50) / 8, 0.0, 1.0);
    EXPECT_NEAR(blurred(2, x)[0], 100 * beyond, 2) << x;
    if (blurred(2, x)[0] > 2 && blurred(2, x)[0] < 98) ++ramp;
  }
  EXPECT_EQ(ramp, 8);
}

TEST(BlurAlong, LeavesAnEdgeAlongTheMotionSharp) {
  cv::Mat3f light(4, 100, cv::Vec3f(0, 0, 0));
  light.colRange(50, 100).setTo(cv::Scalar::all(100));
  EXPECT_EQ(cv::norm(BlurAlong(light, cv::Mat2f(light.size(), cv::Vec2f(0, 8))), light), 0);
  EXPECT_EQ(cv::norm(BlurAlong(light, cv::Mat2f(light.size(), cv::Vec2f(0, 0))), light), 0);
}

TEST(Noise, GrowsInTheDark) {
  Exposure exposure;
  exposure.vignetting = 0;
  exposure.noise_sigma = 1;
  exposure.shadow_noise = 10;
  const auto measured = [&](double grey) {
    cv::Scalar mean, deviation;
    cv::meanStdDev(Expose(cv::Mat3f(200, 200, cv::Vec3f::all(static_cast<float>(grey))), exposure),
                   mean, deviation);
    return deviation[1];
  };
  for (const float grey : {40.0f, 120.0f, 200.0f}) {
    EXPECT_NEAR(measured(grey), NoiseSigma(grey, exposure), 0.15) << grey;
  }
  EXPECT_GT(measured(40), 2 * measured(200));
}

TEST(Expose, GainsMultiplyTheLight) {
  Exposure exposure;
  exposure.gain = 2;
  exposure.vignetting = exposure.noise_sigma = 0;
  exposure.white_balance = {0.5, 1, 1.25};
  EXPECT_EQ(Expose(cv::Mat3f(2, 2, cv::Vec3f(40, 40, 40)), exposure)(1, 1), cv::Vec3b(40, 80, 100));
}

TEST(AutoExposure, FollowsALightThatChangesWithItsLag) {
  constexpr double kLagS = 0.5, kIntervalS = 0.1;
  std::vector<double> grey(30, 100);
  std::fill(grey.begin() + 10, grey.end(), 200);
  const std::vector<double> gains = AutoExposure(grey, 100, kIntervalS, kLagS);
  EXPECT_NEAR(gains[9], 1, 1e-9);
  const double after_a_lag = std::log(gains[9 + 5]) / std::log(0.5);
  EXPECT_NEAR(after_a_lag, 1 - std::exp(-1), 1e-9);
  EXPECT_NEAR(gains.back(), 0.5, 0.02);
}

TEST(Crop, ShiftsThePrincipalPoint) {
  const Camera part = Crop(kCamera, {64, 10, 576, 450});
  EXPECT_EQ(part.PrincipalPoint(), Eigen::Vector2d(320 - 64, 240 - 10));
  EXPECT_EQ(part.center_offset_px, Eigen::Vector2d(-32, 5));
}

TEST(Crop, CameraOfAPartSeesThePartOfThePhoto) {
  const Place place = PlateBeforeWall({0.4f, 4.9f, 0.1f}, 1);
  const Pose pose = LookAt({0.3, -0.2, 0.1}, {0, 5, 0.2}, 0.05);
  const cv::Rect box(64, 10, 576, 450);
  const cv::Mat3f whole = RenderLight(place, kCamera, {pose, {}, {}});
  const cv::Mat3f part = RenderLight(place, Crop(kCamera, box), {pose, {}, {}});
  const auto middle = [](const cv::Mat3f& image) {  // photo edges are sampled otherwise
    return image(cv::Rect(2, 2, image.cols - 4, image.rows - 4));
  };
  EXPECT_LT(cv::norm(middle(part), middle(whole(box)), cv::NORM_INF), 2);
}

TEST(Motion, LeadsFromOnePoseToTheOther) {
  const Pose from = LookAt({0.3, -0.2, 0.1}, {0, 5, 0.2}, 0.05);
  const Pose to = LookAt({0.2, -0.1, 0.3}, {0.4, 5, 0.4}, 0.01);
  const Pose reached = PoseAfter(from, MotionBetween(from, to, 0.5), 0.5);
  EXPECT_LT((reached.center - to.center).norm(), 1e-12);
  EXPECT_LT(reached.cam_from_world.angularDistance(to.cam_from_world), 1e-7);
}

// A camera that moves by v beside an edge at depth z: x of the edge changes by f v t / z.
TEST(RollingShutter, SlantOfAnEdgeIsFocalTimesSpeedTimesReadoutOverDepth) {
  constexpr double kSpeed = 5, kReadoutS = 0.02, kDepth = 4.9;
  Camera camera = kCamera;
  camera.distortion = 0;
  View view{LookAt({0, 0, 0}, {0, 5, 0}, 0), {{kSpeed, 0, 0}, {0, 0, 0}}, {0, kReadoutS}};
  const cv::Mat1f plate = Plate(RenderLight(PlateBeforeWall({10, kDepth, 0}, 20), camera, view));
  const auto edge_px = [&](int y) { return camera.width - cv::sum(plate.row(y))[0]; };
  const double slant = edge_px(0) - edge_px(camera.height - 1);
  const double rows = (camera.height - 1.0) / camera.height;
  EXPECT_NEAR(slant, camera.focal_px * kSpeed * kReadoutS * rows / kDepth, 0.25);  // 1/3 px a ray
  EXPECT_NEAR((edge_px(239) + edge_px(240)) / 2, camera.width / 2.0, 0.2);         // the true pose
}

TEST(RollingShutter, PointIsWhereThePoseOfItsRowProjectsIt) {
  const View view{LookAt({0.3, -0.2, 0.1}, {0, 5, 0.2}, 0.05),
                  {{1.5, 0.4, -0.5}, {0.3, -0.6, 0.2}},
                  {0.015, 0.03}};
  for (const float z : {-1.2f, 0.21f, 1.4f}) {
    const Eigen::Vector3f at(0.5f, 4.9f, z);
    const cv::Mat1f plate = Plate(RenderLight(PlateBeforeWall(at), kCamera, view));
    const Eigen::Vector2d seen = Centroid(plate);
    const Pose of_row = PoseAfter(view.pose, view.motion, view.shutter.RowDelay(seen.y(), 480));
    EXPECT_LT((seen - Projected(of_row, at)).norm(), 0.15) << z;
    const double off_px = (seen - Projected(view.pose, at)).norm();
    if (std::abs(seen.y() - 240) < 12) {
      EXPECT_LT(off_px, 0.5) << "near the middle row";
    } else {
      EXPECT_GT(off_px, 1) << z;
    }
  }
}

TEST(MotionBlur, IsAsLongAsTheImageMotionOfTheExposure) {
  constexpr double kSpeed = 4, kExposureS = 0.02, kDepth = 4.9;
  Camera camera = kCamera;
  camera.distortion = 0;
  const View view{LookAt({0, 0, 0}, {0, 5, 0}, 0), {{kSpeed, 0, 0}, {0, 0, 0}}, {kExposureS, 0}};
  const cv::Mat3f light = RenderLight(PlateBeforeWall({10, kDepth, 0}, 20), camera, view);
  const double length_px = camera.focal_px * kSpeed * kExposureS / kDepth;
  const auto level = [&](double x_px) {
    return (light(200, static_cast<int>(x_px))[1] - light(200, 10)[1]) /
           (light(200, 630)[1] - light(200, 10)[1]);
  };
  EXPECT_NEAR(level(320 - length_px / 4), 0.25, 0.08);
  EXPECT_NEAR(level(320 + length_px / 4), 0.75, 0.08);
  EXPECT_LT(level(320 - length_px / 2 - 1.5), 0.02);
  EXPECT_GT(level(320 + length_px / 2 + 1.5), 0.98);
}

}  // namespace effects_test
}  // namespace skein::sim
