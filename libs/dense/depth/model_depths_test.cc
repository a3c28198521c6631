#include "depth/model_depths.h"

#include <gtest/gtest.h>

#include <atomic>
#include <opencv2/imgproc.hpp>
#include <string>

#include "depth/wall_photos.h"

namespace skein::depth_test {
namespace {

constexpr int kSizePx = 800;

LensCamera WallLens() {
  const DepthCamera camera = WallCamera();
  return {camera.width, camera.height, camera.focal_px, camera.principal_point_px,
          [camera](const Eigen::Vector2d& ray) -> std::optional<Eigen::Vector2d> {
            return camera.Pixel(ray);
          }};
}

// Photos of the wall that all observe a hundred points of it.
DepthScene WallScene(const std::vector<DepthPose>& poses) {
  DepthScene scene;
  std::vector<int> all;
  for (int p = 0; p < 100; ++p) {
    const double x = -5 + 1.2 * (p % 10), y = -4 + 0.9 * (p / 10);
    scene.points.emplace_back(x, y, Wall().distance + Wall().slope * x);
    all.push_back(p);
  }
  for (size_t i = 0; i < poses.size(); ++i) {
    scene.names.push_back(std::to_string(i));
    scene.lenses.push_back(WallLens());
    scene.cameras.push_back(1);
    scene.photos.push_back({poses[i], all});
  }
  return scene;
}

ScenePhoto PhotosOf(const DepthScene& scene) {
  return [&scene](size_t i) -> Result<cv::Mat3b> {
    cv::Mat3b photo;
    cv::cvtColor(Wall().Photo(scene.photos[i].cam_from_world).grey, photo, cv::COLOR_GRAY2BGR);
    return photo;
  };
}

const std::vector<DepthPose> kFour = {PoseAt({0, 0, 0}), PoseAt({1.2, 0, 0}), PoseAt({0, 1.2, 0}),
                                      PoseAt({1.2, 1.2, 0}, 0, 0.4)};

TEST(ModelDepths, PhotosOfAWallAgreeOnIt) {
  const DepthScene scene = WallScene(kFour);
  std::atomic<int> count{0};
  const auto depths = MakeModelDepths(scene, kSizePx, PhotosOf(scene), [&] { ++count; });
  ASSERT_TRUE(depths.ok()) << depths.error();
  EXPECT_EQ(count, 4);
  ASSERT_EQ(depths->maps.size(), kFour.size());
  EXPECT_GT(MeanCompleteness(depths->maps), 0.5);
  const auto points = depths->Points();
  ASSERT_FALSE(points[0].empty());
  const Eigen::Vector3f& point = points[0][points[0].size() / 2].position;
  EXPECT_NEAR(point.z(), Wall().distance + Wall().slope * point.x(), 0.1);
}

TEST(ModelDepths, MapsConfirmEachOtherBothWays) {
  DepthInput input;
  input.neighbours = {{1, 2}, {2}, {}};
  const std::vector<std::vector<int>> expected = {{1, 2}, {2, 0}, {0, 1}};
  EXPECT_EQ(input.Confirming(), expected);
}

TEST(ModelDepths, APhotoThatCannotBeReadIsTold) {
  const DepthScene scene = WallScene(kFour);
  const auto depths = MakeModelDepths(
      scene, kSizePx,
      [](size_t i) -> Result<cv::Mat3b> { return NotFound("no photo " + std::to_string(i)); },
      [] {});
  EXPECT_EQ(depths.error(), "no photo 0");
}

TEST(ModelDepths, APhotoWithoutNeighboursHasHolesAlone) {
  const DepthScene scene = WallScene({kFour[0]});
  const auto depths = MakeModelDepths(scene, kSizePx, PhotosOf(scene), [] {});
  ASSERT_TRUE(depths.ok()) << depths.error();
  EXPECT_EQ(MeanCompleteness(depths->maps), 0);
}

}  // namespace
}  // namespace skein::depth_test
