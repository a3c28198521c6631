#include "benchmark/support/volume_over_plane.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <functional>
#include <random>

namespace skein::volume_over_plane_test {
namespace {

using Eigen::Vector3d;
using HeightField = std::function<double(double x, double y)>;

constexpr double kHeapRadius = 2, kHeapHeight = 1.5;
constexpr double kConeVolume = M_PI * kHeapRadius * kHeapRadius * kHeapHeight / 3;

double Cone(double x, double y) {
  return std::max(0.0, kHeapHeight * (1 - std::hypot(x, y) / kHeapRadius));
}

double Paraboloid(double x, double y) {
  return std::max(0.0, kHeapHeight * (1 - (x * x + y * y) / (kHeapRadius * kHeapRadius)));
}

// At random places of a square.
std::vector<Vector3d> HeapPoints(const HeightField& surface) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> place(-3.3, 3.3);
  std::vector<Vector3d> points;
  for (int i = 0; i < 20000; ++i) {
    const double x = place(random), y = place(random);
    points.emplace_back(x, y, surface(x, y));
  }
  return points;
}

// Around the heap, on a surface, neither level with the axes nor a square.
std::vector<Vector3d> HeapCorners(const HeightField& surface) {
  std::vector<Vector3d> corners;
  for (const auto& [x, y] : {std::pair{-2.5, -2.6}, {2.6, -2.4}, {2.8, 2.5}, {-2.4, 2.7}}) {
    corners.emplace_back(x, y, surface(x, y));
  }
  return corners;
}

std::optional<PlaneVolume> MeasureHeap(const HeightField& surface) {
  return VolumeOverPlane(HeapPoints(surface), HeapCorners(surface), Vector3d::UnitZ());
}

TEST(VolumeOverPlane, HeapsHaveTheirVolumes) {
  const auto cone = MeasureHeap(Cone), paraboloid = MeasureHeap(Paraboloid);
  ASSERT_TRUE(cone && paraboloid);
  EXPECT_NEAR(cone->above, kConeVolume, 0.01 * kConeVolume);
  EXPECT_NEAR(paraboloid->above, 1.5 * kConeVolume, 0.015 * kConeVolume);
  EXPECT_LT(cone->below, 0.001 * kConeVolume);
  EXPECT_LT(cone->filled, 0.01);
}

TEST(VolumeOverPlane, PitIsBelow) {
  const auto pit = MeasureHeap([](double x, double y) { return -Cone(x, y); });
  ASSERT_TRUE(pit);
  EXPECT_NEAR(pit->below, kConeVolume, 0.01 * kConeVolume);
  EXPECT_LT(pit->above, 0.001 * kConeVolume);
}

// A shear keeps the volume.
TEST(VolumeOverPlane, BaseFollowsASlopeInAnyFrameAndUnit) {
  const HeightField surface = [](double x, double y) { return Cone(x, y) + 0.5 * x - 0.2 * y; };
  const Eigen::Quaterniond turn = Eigen::Quaterniond(0.5, 0.4, -0.7, 0.2).normalized();
  const auto moved = [&](std::vector<Vector3d> all) {
    for (Vector3d& p : all) p = 0.1 * (turn * p) + Vector3d(40, -7, 3);
    return all;
  };
  const auto heap = VolumeOverPlane(moved(HeapPoints(surface)), moved(HeapCorners(surface)),
                                    turn * Vector3d::UnitZ());
  ASSERT_TRUE(heap);
  EXPECT_NEAR(1e3 * heap->above, kConeVolume, 0.01 * kConeVolume);
}

TEST(VolumeOverPlane, PointsOfTheBorderMendPickedCorners) {
  std::vector<Vector3d> corners = HeapCorners(Cone);
  for (Vector3d& corner : corners) corner.z() += 0.05;
  const auto heap = VolumeOverPlane(HeapPoints(Cone), corners, Vector3d::UnitZ());
  ASSERT_TRUE(heap);
  EXPECT_NEAR(heap->above, kConeVolume, 0.01 * kConeVolume);
}

TEST(VolumeOverPlane, HoleIsFilledFromItsSurroundingsAndTold) {
  constexpr double kHole = 0.5;
  std::vector<Vector3d> points;
  for (const Vector3d& p : HeapPoints(Cone)) {
    if ((p.head<2>() - Eigen::Vector2d(1, 0)).norm() > kHole) points.push_back(p);
  }
  const auto heap = VolumeOverPlane(points, HeapCorners(Cone), Vector3d::UnitZ());
  ASSERT_TRUE(heap);
  const double share = M_PI * kHole * kHole / heap->area;  // cells at its border hold points
  EXPECT_GT(heap->filled, 0.7 * share);
  EXPECT_LT(heap->filled, share);
  EXPECT_NEAR(heap->above, kConeVolume, 0.01 * kConeVolume);
}

TEST(VolumeOverPlane, NeedsAPolygonAndPoints) {
  const std::vector<Vector3d> points = HeapPoints(Cone), corners = HeapCorners(Cone);
  const Vector3d up = Vector3d::UnitZ();
  EXPECT_FALSE(VolumeOverPlane(points, {corners[0], corners[1]}, up));
  EXPECT_FALSE(VolumeOverPlane(points, {corners[0], corners[1], corners[0]}, up));
  EXPECT_FALSE(VolumeOverPlane({}, corners, up));
}

}  // namespace
}  // namespace skein::volume_over_plane_test
