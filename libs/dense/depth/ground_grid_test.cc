#include "depth/ground_grid.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace skein::depth_test {
namespace {

constexpr int kSide = 100;
constexpr double kHeight = 20;  // of the cameras above the ground
constexpr double kPixel = 0.1;  // of the ground
const Eigen::Isometry3d kLevelModel = Eigen::Isometry3d::Identity();

// Looks straight down, the photo's top to the north. East of x = 2 stands a block 4 high.
struct Flight {
  explicit Flight(double east, double north = 0) {
    const DepthCamera camera{kSide, kSide, {kHeight / kPixel, kHeight / kPixel}, {50, 50}};
    DepthPose pose;
    pose.rotation << 1, 0, 0, 0, -1, 0, 0, 0, -1;
    pose.translation = -pose.rotation * Eigen::Vector3d(east, north, kHeight);
    map = {camera, pose, cv::Mat1f(kSide, kSide), cv::Mat1f(kSide, kSide, 0.01f)};
    colours = cv::Mat3b(kSide, kSide);
    for (int y = 0; y < kSide; ++y) {
      for (int x = 0; x < kSide; ++x) Fill(x, y, east);
    }
    points = PointsOf(map, colours, {});
  }

  void Fill(int x, int y, double east) {
    const Eigen::Vector2d ray = map.camera.Ray({x + 0.5, y + 0.5});
    const bool is_block = east + ray.x() * (kHeight - 4) > 2;
    map.depth(y, x) = static_cast<float>(is_block ? kHeight - 4 : kHeight);
    colours(y, x) = is_block ? cv::Vec3b(0, 0, 200) : cv::Vec3b(0, 200, 0);
  }

  ColouredMap Coloured() const { return {&map, &colours, &points}; }

  DepthMap map;
  cv::Mat3b colours;
  std::vector<DensePoint> points;
};

cv::Point CellAt(const GroundGrid& grid, double east, double north) {
  return {static_cast<int>((east - grid.west) / grid.cell),
          static_cast<int>((grid.north - north) / grid.cell)};
}

TEST(GroundGrid, HasTheHeightsAndColoursOfTheGround) {
  const Flight a(0), b(1.5, 0.5);
  const std::vector<ColouredMap> maps = {a.Coloured(), b.Coloured()};
  EXPECT_NEAR(GroundSamplingDistance(maps), kPixel, 0.02);
  const GroundGrid grid = MakeGroundGrid(maps, kLevelModel, 0.1);
  EXPECT_GT(grid.Completeness(), 0.8);
  const cv::Point ground = CellAt(grid, -2, 1), block = CellAt(grid, 3, 1);
  EXPECT_NEAR(grid.height(ground), 0, 1e-3);
  EXPECT_NEAR(grid.height(block), 4, 1e-3);
  EXPECT_EQ(grid.colour(ground), cv::Vec4b(0, 200, 0, 255));
  EXPECT_EQ(grid.colour(block), cv::Vec4b(0, 0, 200, 255));
}

// Colours of a row of cells between two photos of the flat ground, whose middles lie 4 apart.
std::vector<int> GreyFromWestToEast() {
  Flight west(-10), east(-6);
  west.colours.setTo(cv::Scalar::all(100));
  east.colours.setTo(cv::Scalar::all(200));
  const GroundGrid grid = MakeGroundGrid({west.Coloured(), east.Coloured()}, kLevelModel, 0.1);
  std::vector<int> greys;
  for (double x = -10; x <= -6; x += 0.25) greys.push_back(grid.colour(CellAt(grid, x, 0))[0]);
  return greys;
}

TEST(GroundGrid, ACellHasTheColourOfThePhotoThatSeesItBest) {
  const std::vector<int> greys = GreyFromWestToEast();
  // x = -9: 40 pixels from the border of one photo, 20 from that of the other.
  for (size_t i = 0; i <= 4; ++i) EXPECT_EQ(greys[i], 100) << i;
  for (size_t i = 12; i < greys.size(); ++i) EXPECT_EQ(greys[i], 200) << i;
}

TEST(GroundGrid, TheSeamBetweenTwoPhotosIsFeathered) {
  const std::vector<int> greys = GreyFromWestToEast();
  EXPECT_NEAR(greys[8], 150, 20) << "half-way";
  EXPECT_TRUE(std::is_sorted(greys.begin(), greys.end()));
}

// The same in a model whose frame lies on its side, with coordinates as in a national grid.
TEST(GroundGrid, IsInTheLevelFrame) {
  const Eigen::Isometry3d level_from_model =
      Eigen::Translation3d(5e6, -3e6, 2e6) * Eigen::AngleAxisd(M_PI / 2, Eigen::Vector3d::UnitX());
  Flight a(0);
  DepthPose& pose = a.map.cam_from_world;
  pose.translation += pose.rotation * level_from_model.translation();
  pose.rotation = pose.rotation * level_from_model.linear();
  a.points = PointsOf(a.map, a.colours, {});
  const GroundGrid grid = MakeGroundGrid({a.Coloured()}, level_from_model, 0.1);
  const cv::Point ground = CellAt(grid, -2, 1), block = CellAt(grid, 3, 1);
  EXPECT_NEAR(grid.height(ground), 0, 1e-3);
  EXPECT_NEAR(grid.height(block), 4, 1e-3);
  EXPECT_EQ(grid.colour(ground), cv::Vec4b(0, 200, 0, 255));
  EXPECT_EQ(grid.colour(block), cv::Vec4b(0, 0, 200, 255));
}

TEST(GroundGrid, GroundThatNoMapShowsIsAHole) {
  const Flight a(-20), b(20);
  const GroundGrid grid = MakeGroundGrid({a.Coloured(), b.Coloured()}, kLevelModel, 0.2);
  const cv::Point between = CellAt(grid, 0, 0);
  EXPECT_TRUE(grid.IsHole(between.y, between.x));
  EXPECT_EQ(grid.colour(between)[3], 0);
  EXPECT_LT(grid.Completeness(), 0.6);
}

TEST(GroundGrid, AFarPointDoesNotMakeItLarge) {
  Flight a(0);
  a.points.push_back({{1e6f, 1e6f, 0}, {0, 0, 1}, {}});
  const GroundGrid grid = MakeGroundGrid({a.Coloured()}, kLevelModel, 0.1);
  EXPECT_LT(grid.height.cols, 200);
}

TEST(GroundGrid, TooManyCellsBecomeLarger) {
  const Flight a(0);
  const GroundGrid grid = MakeGroundGrid({a.Coloured()}, kLevelModel, 1e-4, 1e4);
  EXPECT_LE(grid.height.total(), 10000);
  EXPECT_NEAR(grid.cell, 0.1, 0.02);
}

TEST(GroundGrid, PointsOnALineHaveNoMoreCells) {
  Flight a(0);
  for (size_t i = 0; i < a.points.size(); ++i) a.points[i].position = {static_cast<float>(i), 0, 0};
  const GroundGrid grid = MakeGroundGrid({a.Coloured()}, kLevelModel, 0.01, 1e4);
  EXPECT_LE(grid.height.total(), 10000);
}

TEST(GroundGrid, IsEmptyWithoutPoints) {
  Flight a(0);
  a.points.clear();
  EXPECT_TRUE(MakeGroundGrid({a.Coloured()}, kLevelModel, 0.1).height.empty());
  EXPECT_EQ(GroundSamplingDistance({}), 0);
}

}  // namespace
}  // namespace skein::depth_test
