#include "depth/model_depths.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <opencv2/imgproc.hpp>
#include <string>

#include "depth/ground_grid.h"
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
  const Eigen::Vector3d& point = points[0][points[0].size() / 2].position;
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
  const CheckedDepths in_memory = CheckDepths(maps, input->Confirming());
  for (size_t i = 0; i < kFour.size(); ++i) {
    ExpectEqual(in_file->maps[i].depth, in_memory.maps[i].depth);
    ExpectEqual(in_file->maps[i].error, in_memory.maps[i].error);
    ExpectEqual(in_file->masks[i], in_memory.masks[i]);
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

// ---- A board before the wall, parallel to the photos ----

constexpr double kBoardZ = 6, kBoardSide = 0.9;
using Corner = std::optional<Eigen::Vector2d>;  // nullopt: no board

struct BoardScene {
  std::vector<DepthMap> maps;
  std::vector<cv::Mat1b> boards;  // 255: the pixel shows the board
  CheckedDepths checked;
};

// Six photos of the wall, each with its own board.
BoardScene SceneWith(const std::vector<Corner>& corners) {
  BoardScene scene;
  std::vector<std::vector<int>> confirming;
  for (int i = 0; i < 6; ++i) {
    const Eigen::Vector3d centre(1.2 * (i % 3), 1.2 * (i / 3), 0);
    DepthMap map = Wall().Map(PoseAt(centre), 0.02f);
    cv::Mat1b board(map.depth.size(), 0);
    confirming.emplace_back();
    for (int other = 0; other < 6; ++other) {
      if (other != i) confirming[i].push_back(other);
    }
    for (int y = 0; corners[i] && y < kWallHeight; ++y) {
      for (int x = 0; x < kWallWidth; ++x) {
        const Eigen::Vector2d ray = map.camera.Ray({x + 0.5, y + 0.5});
        const Eigen::Array2d on_board = centre.head<2>() + kBoardZ * ray - *corners[i];
        board(y, x) = (on_board >= 0).all() && (on_board < kBoardSide).all() ? 255 : 0;
      }
    }
    map.depth.setTo(kBoardZ, board);
    scene.maps.push_back(map);
    scene.boards.push_back(board);
  }
  scene.checked = CheckDepths(scene.maps, confirming);
  return scene;
}

// Photos are 200 on the boards, 0 elsewhere.
struct BoardSurface {
  double nearest_z = 1e6;  // of the dense points
  int brightest = 0;       // of the orthophoto
};

BoardSurface SurfaceOf(const BoardScene& scene) {
  std::vector<cv::Mat3b> colours;
  std::vector<std::vector<DensePoint>> points;
  for (size_t i = 0; i < scene.maps.size(); ++i) {
    colours.emplace_back(scene.boards[i].size(), cv::Vec3b());
    colours[i].setTo(cv::Scalar::all(200), scene.boards[i]);
    points.push_back(PointsOf(scene.checked.maps[i], colours[i], {}));
  }
  BoardSurface surface;
  std::vector<ColouredMap> maps;
  for (size_t i = 0; i < points.size(); ++i) {
    maps.push_back({&scene.checked.maps[i], &colours[i], &points[i], &scene.checked.masks[i]});
    for (const DensePoint& p : points[i]) {
      surface.nearest_z = std::min(surface.nearest_z, p.position.z());
    }
  }
  const Eigen::Isometry3d up_to_cameras(Eigen::AngleAxisd(M_PI, Eigen::Vector3d::UnitX()));
  const GroundGrid grid = MakeGroundGrid(maps, up_to_cameras, GroundSamplingDistance(maps));
  for (const cv::Vec4b& colour : grid.colour) {
    surface.brightest = std::max<int>(surface.brightest, colour[0]);
  }
  return surface;
}

constexpr float kBeforeWall = 7;  // the wall is farther off, the board nearer

TEST(CheckDepths, ABoardThatStandsElsewhereInEachPhotoIsInNoSurface) {
  std::vector<Corner> corners;
  for (int i = 0; i < 6; ++i) {
    corners.push_back(Eigen::Vector2d(1.2 * (i % 3) - 0.7, 1.5 * (i / 3) - 0.9));
  }
  const BoardScene scene = SceneWith(corners);
  for (size_t i = 0; i < 6; ++i) {
    EXPECT_GT(cv::countNonZero(scene.boards[i]), 400);
    ExpectEqual(scene.checked.masks[i], ~scene.boards[i]);
    EXPECT_EQ(scene.checked.counts[i].contradicted, cv::countNonZero(scene.boards[i]));
    EXPECT_GT(scene.checked.maps[i].Completeness(), 0.8) << "the wall stays";
  }
  const BoardSurface surface = SurfaceOf(scene);
  EXPECT_GT(surface.nearest_z, kBeforeWall);
  EXPECT_EQ(surface.brightest, 0);
}

TEST(CheckDepths, ABoardThatStaysIsInTheSurface) {
  const BoardScene scene = SceneWith(std::vector<Corner>(6, Eigen::Vector2d(0.8, 0.2)));
  for (size_t i = 0; i < 6; ++i) {
    EXPECT_EQ(cv::countNonZero(scene.checked.masks[i] == 0), 0);
    EXPECT_EQ(cv::countNonZero((scene.checked.maps[i].depth > 0) & scene.boards[i]),
              cv::countNonZero(scene.boards[i]));
  }
  const BoardSurface surface = SurfaceOf(scene);
  EXPECT_NEAR(surface.nearest_z, kBoardZ, 0.01);
  EXPECT_EQ(surface.brightest, 200);
}

// Two others agree with each of its depths, three see past it.
TEST(CheckDepths, ABoardThatStoodInThreePhotosOfSixIsInNoSurface) {
  std::vector<Corner> corners(6);
  std::fill_n(corners.begin(), 3, Eigen::Vector2d(0.8, 0.2));
  const BoardScene scene = SceneWith(corners);
  for (size_t i = 0; i < 6; ++i) ExpectEqual(scene.checked.masks[i], ~scene.boards[i]);
  EXPECT_GT(SurfaceOf(scene).nearest_z, kBeforeWall);
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
