#include "clients/sim/scenario.h"

#include <gtest/gtest.h>

#include <cmath>

#include "clients/places/outdoors.h"

namespace skein::sim {
namespace scenario_test {

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

TEST(Walks, SurveyCoversASquareInLanes) {
  ScenarioOptions options;
  options.scenario = Scenario::kSurvey;
  options.agents = 3;
  options.photos = 300;
  double low = 0, high = 0;
  for (const Walk& walk : PlanWalks(options)) {
    for (int i = 0; i < options.photos; ++i) {
      const Pose& pose = walk.shots[i].pose;
      low = std::min(low, pose.center.head<2>().minCoeff());
      high = std::max(high, pose.center.head<2>().maxCoeff());
      EXPECT_LT((pose.cam_from_world.conjugate() * Eigen::Vector3d::UnitZ()).z(), -0.98);
      if (i == 0) continue;
      EXPECT_LT((pose.center - walk.shots[i - 1].pose.center).norm(), 46);
    }
  }
  EXPECT_NEAR(high - low, 1000, 30);
}

TEST(Walks, AgentsOfTheSharedObjectKeepToTheirRooms) {
  ScenarioOptions options;
  options.scenario = Scenario::kSharedObject;
  options.agents = 4;
  const std::vector<Walk> walks = PlanWalks(options);
  for (const int agent : {0, 2}) {
    for (const Shot& shot : walks[agent].shots) EXPECT_LT(std::abs(shot.pose.center.x()), 3);
    for (const Shot& shot : walks[agent + 1].shots) EXPECT_GT(shot.pose.center.x(), 8);
  }
}

}  // namespace scenario_test
}  // namespace skein::sim
