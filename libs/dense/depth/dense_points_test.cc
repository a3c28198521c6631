#include "depth/dense_points.h"

#include <gtest/gtest.h>

#include "testing/wall_photos.h"

namespace skein::depth_test {
namespace {

const cv::Mat3b kColours(kWallHeight, kWallWidth, cv::Vec3b(10, 20, 30));

TEST(DensePoints, LieOnTheSurfaceAndHaveItsNormal) {
  const DepthMap map = Wall().Map(PoseAt({1, 0, 0}, 0.1, 0.3), 0.02f);
  const std::vector<DensePoint> points = PointsOf(map, kColours, {});
  ASSERT_EQ(points.size(), static_cast<size_t>(kWallWidth * kWallHeight));
  const Wall wall;
  const Eigen::Vector3f normal =
      Eigen::Vector3d(wall.slope, 0, -1).normalized().cast<float>();  // towards the cameras
  for (const DensePoint& point : points) {
    ASSERT_NEAR(point.position.z(), wall.distance + wall.slope * point.position.x(), 1e-3);
    ASSERT_GT(point.normal.dot(normal), 0.999);
    ASSERT_EQ(point.colour, cv::Vec3b(10, 20, 30));
  }
}

TEST(DensePoints, APartOfTheSurfaceComesFromTheMapThatShowsItBest) {
  const DepthMap good = Wall().Map(PoseAt({0, 0, 0}), 0.01f),
                 bad = Wall().Map(PoseAt({1, 0, 0}), 0.02f);
  const size_t all = kWallWidth * kWallHeight;
  EXPECT_EQ(PointsOf(good, kColours, {&bad}).size(), all);
  const size_t beside = PointsOf(bad, kColours, {&good}).size();
  EXPECT_GT(beside, 0) << "the second map shows what the first one does not";
  EXPECT_LT(beside, all / 4);
}

TEST(DensePoints, ASinglePixelIsLeftOut) {
  DepthMap map = Wall().Map(PoseAt({0, 0, 0}), 0.01f);
  const float depth = map.depth(60, 80);
  map.depth = 0;
  map.depth(60, 80) = depth;
  EXPECT_TRUE(PointsOf(map, kColours, {}).empty());
}

TEST(DensePoints, AnEdgeIsNoSlope) {
  DepthMap map = Wall().Map(PoseAt({0, 0, 0}), 0.01f);
  map.depth.colRange(0, 80) = 5.0f;  // something before the wall
  for (const DensePoint& point : PointsOf(map, kColours, {})) {
    ASSERT_LT(point.normal.z(), -0.9) << point.position.transpose();
  }
}

}  // namespace
}  // namespace skein::depth_test
