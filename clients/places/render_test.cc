#include "clients/places/render.h"

#include <gtest/gtest.h>

#include <opencv2/imgproc.hpp>

#include "clients/places/camera.h"
#include "clients/places/solids.h"
#include "testing/test_plate.h"

namespace skein::sim {
namespace render_test {

TEST(Camera, UndistorterInvertsColmapsModel) {
  const Camera camera{1280, 960, 1100, -0.08};
  const Undistorter undistort(camera);
  const Pose pose;
  for (const Eigen::Vector2f& pixel :
       {Eigen::Vector2f(1, 1), Eigen::Vector2f(640, 480), Eigen::Vector2f(1279, 300)}) {
    const Eigen::Vector2f uv = undistort(pixel.x(), pixel.y());
    Eigen::Vector2d back;
    ASSERT_TRUE(Project(camera, pose, Eigen::Vector3d(uv.x(), uv.y(), 1), &back));
    EXPECT_LT((back - pixel.cast<double>()).norm(), 2e-3);
  }
}

TEST(Render, PlateAppearsWhereTheTruthProjectsIt) {
  const Camera camera{640, 480, 550, -0.06};
  const Pose pose = LookAt({0.3, -0.2, 0.1}, {0, 5, 0.2}, 0.05);
  for (const Eigen::Vector3f& plate :
       {Eigen::Vector3f(0, 4.9f, 0), Eigen::Vector3f(1.7f, 4.9f, -1.2f)}) {
    const cv::Mat3b photo = RenderPhoto(PlateBeforeWall(plate), camera, pose, {1, 0, 0, 1});
    cv::Mat1b grey;
    cv::cvtColor(photo, grey, cv::COLOR_BGR2GRAY);
    double wall = 0;
    cv::minMaxLoc(grey, &wall);
    const cv::Moments m = cv::moments(cv::Mat(grey - wall));
    Eigen::Vector2d expected;
    ASSERT_TRUE(Project(camera, pose, plate.cast<double>(), &expected));
    EXPECT_NEAR(m.m10 / m.m00 + 0.5, expected.x(), 0.05);  // centre of the first pixel: 0.5
    EXPECT_NEAR(m.m01 / m.m00 + 0.5, expected.y(), 0.05);
  }
}

TEST(Render, IsAFunctionOfItsSeed) {
  const Place place = PlateBeforeWall({0, 4.9f, 0});
  const Camera camera{160, 120, 140, 0};
  const Pose pose = LookAt({0, 0, 0}, {0, 5, 0}, 0);
  const auto render = [&](uint64_t seed) {
    return RenderPhoto(place, camera, pose, {1, 0.1, 2, seed});
  };
  EXPECT_EQ(cv::norm(render(5), render(5)), 0);
  EXPECT_GT(cv::norm(render(5), render(6)), 0);
}

TEST(Solids, ConeHasItsVolume) {
  constexpr double kRadius = 3, kHeight = 2, kStep = 0.05;
  std::vector<Surface> surfaces;
  AddCone(Eigen::Isometry3d::Identity(), kRadius, kHeight, {}, &surfaces);
  const Scene cone(surfaces);
  double volume = 0;
  for (double x = -kRadius + kStep / 2; x < kRadius; x += kStep) {
    for (double y = -kRadius + kStep / 2; y < kRadius; y += kStep) {
      const Eigen::Vector3d above(x, y, 10);
      const Hit hit = cone.Trace(above.cast<float>(), -Eigen::Vector3f::UnitZ());
      if (hit.surface >= 0) volume += kStep * kStep * (10 - hit.t);
    }
  }
  EXPECT_NEAR(volume, ConeVolume(kRadius, kHeight), 1e-3 * volume);
}

}  // namespace render_test
}  // namespace skein::sim
