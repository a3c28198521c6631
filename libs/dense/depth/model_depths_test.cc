#include "depth/model_depths.h"

#include <gtest/gtest.h>

#include <atomic>
#include <opencv2/imgproc.hpp>
#include <string>

#include "testing/test_folder.h"
#include "testing/wall_photos.h"

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

class ModelDepthsTest : public testing::Test {
 protected:
  TestFolder folder_;
};

TEST_F(ModelDepthsTest, PhotosOfAWallAgreeOnIt) {
  const DepthScene scene = WallScene(kFour);
  std::atomic<int> count{0};
  const auto depths = MakeModelDepths(
      scene, kSizePx, PhotosOf(scene), [&] { ++count; }, folder_.path());
  ASSERT_TRUE(depths.ok()) << depths.error();
  EXPECT_EQ(count, 4);
  ASSERT_EQ(depths->maps.size(), kFour.size());
  EXPECT_GT(MeanCompleteness(depths->maps), 0.5);
  ASSERT_EQ(depths->counts.size(), kFour.size());
  EXPECT_EQ(depths->counts[0].agreed, cv::countNonZero(depths->maps[0].depth));
  EXPECT_LT(depths->counts[0].contradicted, depths->counts[0].agreed / 10);
  const auto points = depths->Points();
  ASSERT_FALSE(points[0].empty());
  const Eigen::Vector3f& point = points[0][points[0].size() / 2].position;
  EXPECT_NEAR(point.z(), Wall().distance + Wall().slope * point.x(), 0.1);
}

void ExpectEqual(const cv::Mat& a, const cv::Mat& b) {
  ASSERT_EQ(a.size(), b.size());
  ASSERT_EQ(a.type(), b.type());
  EXPECT_EQ(cv::norm(a, b, cv::NORM_INF), 0);
}

TEST_F(ModelDepthsTest, AFileChangesNoPixel) {
  DepthScene scene = WallScene(kFour);
  scene.cameras = {2, 1, 2, 1};
  const auto in_file = MakeModelDepths(
      scene, kSizePx, PhotosOf(scene), [] {}, folder_.path());
  ASSERT_TRUE(in_file.ok()) << in_file.error();
  const auto input = ReadDepthInput(scene, kSizePx, PhotosOf(scene));
  ASSERT_TRUE(input.ok()) << input.error();
  DepthSweep sweep;
  std::vector<DepthMap> maps;
  for (size_t i = 0; i < kFour.size(); ++i) maps.push_back(SweepPhoto(*input, i, &sweep));
  const std::vector<DepthMap> in_memory = AgreedMaps(maps, input->Confirming());
  for (size_t i = 0; i < kFour.size(); ++i) {
    ExpectEqual(in_file->maps[i].depth, in_memory[i].depth);
    ExpectEqual(in_file->maps[i].error, in_memory[i].error);
    ExpectEqual(in_file->colours[i], input->colours[i]);
  }
  EXPECT_TRUE(std::filesystem::is_empty(folder_.path()));
}

TEST_F(ModelDepthsTest, AFolderWithoutRoomIsToldBeforeAPhotoIsRead) {
  const DepthScene scene = WallScene(kFour);
  bool has_read = false;
  const auto photo = [&](size_t i) {
    has_read = true;
    return PhotosOf(scene)(i);
  };
  const auto depths = MakeModelDepths(
      scene, kSizePx, photo, [] {}, folder_ / "none");
  EXPECT_EQ(depths.code(), StatusCode::kNotFound) << depths.error();
  EXPECT_FALSE(has_read);
}

TEST_F(ModelDepthsTest, MapsConfirmEachOtherBothWays) {
  DepthInput input;
  input.neighbours = {{1, 2}, {2}, {}};
  const std::vector<std::vector<int>> expected = {{1, 2}, {2, 0}, {0, 1}};
  EXPECT_EQ(input.Confirming(), expected);
}

TEST_F(ModelDepthsTest, APhotoThatCannotBeReadIsTold) {
  const DepthScene scene = WallScene(kFour);
  const auto depths = MakeModelDepths(
      scene, kSizePx,
      [](size_t i) -> Result<cv::Mat3b> { return NotFound("no photo " + std::to_string(i)); },
      [] {}, folder_.path());
  EXPECT_EQ(depths.error(), "no photo 0");
}

TEST_F(ModelDepthsTest, APhotoWithoutNeighboursHasHolesAlone) {
  const DepthScene scene = WallScene({kFour[0]});
  const auto depths = MakeModelDepths(
      scene, kSizePx, PhotosOf(scene), [] {}, folder_.path());
  ASSERT_TRUE(depths.ok()) << depths.error();
  EXPECT_EQ(MeanCompleteness(depths->maps), 0);
}

}  // namespace
}  // namespace skein::depth_test
