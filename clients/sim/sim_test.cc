#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/imgproc.hpp>

#include "clients/sim/camera.h"
#include "clients/sim/outdoors.h"
#include "clients/sim/render.h"
#include "clients/sim/scenario.h"
#include "clients/sim/solids.h"
#include "clients/sim/test_places.h"

namespace skein::sim {
namespace sim_test {

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

TEST(Walks, CorridorCentresLieOnALine) {
  ScenarioOptions options;
  options.scenario = Scenario::kCorridor;
  for (const Walk& walk : PlanWalks(options)) {
    for (const Shot& shot : walk.shots) {
      EXPECT_DOUBLE_EQ(shot.pose.center.y(), -0.9);
      EXPECT_DOUBLE_EQ(shot.pose.center.z(), 1.5);
    }
  }
}

TEST(Walks, RelayAgentsFollowEachOther) {
  ScenarioOptions options;
  options.scenario = Scenario::kRelay;
  const std::vector<Walk> walks = PlanWalks(options);
  ASSERT_EQ(walks.size(), 3u);
  EXPECT_GT(walks[1].shots.front().capture_s, walks[0].shots.back().capture_s);
}

TEST(Walks, TwinAgentsKeepApart) {
  ScenarioOptions options;
  options.scenario = Scenario::kTwins;
  options.agents = 2;
  const std::vector<Walk> walks = PlanWalks(options);
  for (const Shot& a : walks[0].shots) {
    for (const Shot& b : walks[1].shots) {
      EXPECT_GT((a.pose.center - b.pose.center).norm(), 60);
    }
  }
}

TEST(Walks, StockpileIsFlownAroundAndOver) {
  ScenarioOptions options;
  options.scenario = Scenario::kStockpile;
  for (const Walk& walk : PlanWalks(options)) {
    int over = 0;
    for (const Shot& shot : walk.shots) {
      EXPECT_GT(shot.pose.center.z(), 2 * kStockpileHeightM);
      const Eigen::Vector3d view = shot.pose.cam_from_world.conjugate() * Eigen::Vector3d::UnitZ();
      EXPECT_LT(view.z(), -0.5);
      over += shot.pose.center.head<2>().norm() < kStockpileRadiusM + 4;
    }
    EXPECT_EQ(over, 6);
  }
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

}  // namespace sim_test
}  // namespace skein::sim
