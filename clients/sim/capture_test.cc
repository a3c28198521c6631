#include "clients/sim/capture.h"

#include <gtest/gtest.h>

#include <algorithm>

namespace skein::sim {
namespace capture_test {

SimOptions Small(Scenario scenario, int photos, uint64_t seed) {
  SimOptions options;
  options.scenario.scenario = scenario;
  options.scenario.agents = 2;
  options.scenario.photos = photos;
  options.scenario.seed = seed;
  options.width = 160;
  options.height = 120;
  return options;
}

cv::Mat3b FirstPhoto(const SimOptions& options) {
  const Place place = BuildPlace(options.scenario, 2);
  const CapturePlan plan = PlanCaptures(options, place);
  return RenderCapture(place, plan.cameras[0], plan.captures[0]);
}

class HardScenario : public testing::TestWithParam<Scenario> {};

TEST_P(HardScenario, PhotosAreAFunctionOfTheSeed) {
  const cv::Mat3b photo = FirstPhoto(Small(GetParam(), 4, 5));
  EXPECT_EQ(cv::norm(FirstPhoto(Small(GetParam(), 4, 5)), photo), 0);
  const cv::Mat3b other = FirstPhoto(Small(GetParam(), 4, 6));
  EXPECT_TRUE(other.size() != photo.size() || cv::norm(other, photo) > 0);
}

INSTANTIATE_TEST_SUITE_P(All, HardScenario,
                         testing::Values(Scenario::kVideo, Scenario::kBlank, Scenario::kCrowd,
                                         Scenario::kSharedObject, Scenario::kFurniture,
                                         Scenario::kCourtyard, Scenario::kStockpile));

TEST(Video, MiddleRowsAreSeenFromTheTruePose) {
  const SimOptions options = Small(Scenario::kVideo, 80, 3);
  const Place place = BuildPlace(options.scenario, 2);
  const CapturePlan plan = PlanCaptures(options, place);
  double top_off = 0;
  for (const int i : {20, 100, 130, 140}) {
    const Capture& frame = plan.captures[i];
    const Camera& camera = plan.cameras[frame.camera];
    const Shutter rolling{0, frame.shutter.readout_s};
    const cv::Mat3f seen =
        RenderLight(place, camera, {frame.shot.pose, frame.shot.motion, rolling});
    const cv::Mat3f still = RenderLight(place, camera, {frame.shot.pose, {}, {}});
    const auto off = [&](int row) {
      return cv::norm(seen.rowRange(row, row + 2), still.rowRange(row, row + 2), cv::NORM_L1) /
             (6.0 * camera.width);
    };
    EXPECT_LT(off(camera.height / 2 - 1), 0.6) << frame.file;
    top_off += off(0) + off(camera.height - 2);
  }
  EXPECT_GT(top_off, 1);
}

TEST(Video, FramesAreCentimetresApartAndSomeAreTurnsOnTheSpot) {
  ScenarioOptions options;
  options.scenario = Scenario::kVideo;
  options.photos = 250;
  int turns = 0;
  for (const Walk& walk : PlanWalks(options)) {
    for (size_t i = 1; i < walk.shots.size(); ++i) {
      const Pose& a = walk.shots[i - 1].pose;
      const Pose& b = walk.shots[i].pose;
      EXPECT_LT((a.center - b.center).norm(), 0.1) << i;
      EXPECT_LT(a.cam_from_world.angularDistance(b.cam_from_world), 12 * kDegree) << i;
      if ((a.center - b.center).norm() < 0.03 &&
          a.cam_from_world.angularDistance(b.cam_from_world) > 4 * kDegree) {
        ++turns;
      }
    }
  }
  EXPECT_GT(turns, 20);
}

TEST(Video, AnAgentEndsWhereTheNextOneFilmed) {
  ScenarioOptions options;
  options.scenario = Scenario::kVideo;
  options.photos = 250;
  const std::vector<Walk> walks = PlanWalks(options);
  for (size_t agent = 1; agent < walks.size(); ++agent) {
    const Eigen::Vector3d begin = walks[agent].shots.front().pose.center;
    double nearest_m = 1e9;
    for (const Shot& shot : walks[agent - 1].shots) {
      nearest_m = std::min(nearest_m, (shot.pose.center - begin).norm());
    }
    EXPECT_LT(nearest_m, 0.2);
    EXPECT_GT((walks[agent - 1].shots.front().pose.center - begin).norm(), 1);
  }
}

TEST(Crowd, EveryPhotoHasACameraOfItsOwn) {
  const SimOptions options = Small(Scenario::kCrowd, 50, 4);
  const CapturePlan plan = PlanCaptures(options, Place());
  int cropped = 0, portrait = 0, with_exif = 0, with_people = 0;
  ASSERT_EQ(plan.cameras.size(), 100u);
  for (size_t i = 0; i < plan.captures.size(); ++i) {
    const Camera& camera = plan.cameras[i];
    EXPECT_EQ(plan.captures[i].camera, static_cast<int>(i));
    EXPECT_LE(std::max(camera.width, camera.height), 160);
    const Eigen::Vector2d whole = 2 * Eigen::Vector2d(camera.width, camera.height) / 2 +
                                  2 * camera.center_offset_px.cwiseAbs();  // before the crop
    EXPECT_LE(std::abs(camera.center_offset_px.x()), 0.1 * whole.x());
    EXPECT_LE(std::abs(camera.center_offset_px.y()), 0.1 * whole.y());
    cropped += camera.center_offset_px.norm() > 0;
    portrait += camera.height > camera.width;
    with_exif += plan.captures[i].exif.has_value();
    with_people += !plan.captures[i].moving.empty();
  }
  for (const int half : {cropped, portrait, with_exif}) {
    EXPECT_GT(half, 25);
    EXPECT_LT(half, 75);
  }
  EXPECT_GT(with_people, 90);
}

}  // namespace capture_test
}  // namespace skein::sim
