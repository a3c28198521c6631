#include "clients/places/furniture.h"

#include <gtest/gtest.h>

#include "clients/places/render.h"

namespace skein::sim {
namespace furniture_test {

using Eigen::Isometry3d;
using Eigen::Translation3d;
using Eigen::Vector3d;

Isometry3d At(double x, double y) { return Isometry3d::Identity() * Translation3d(x, y, 0); }

// From before the front of what stands at `foot`, slightly from the left.
cv::Mat3f Front(const Place& place, const Isometry3d& foot) {
  const Vector3d eye = foot * Vector3d(-0.6, -1.3, 1.6), target = foot * Vector3d(0, 0, 0.9);
  return RenderLight(place, {160, 120, 140, 0}, {LookAt(eye, target, 0), {}, {}});
}

// Mean difference of a pixel's colours, white: 255.
double Difference(const cv::Mat3f& a, const cv::Mat3f& b) {
  return cv::norm(a, b, cv::NORM_L1) / (3.0 * static_cast<double>(a.total()));
}

Place Indoors(PlaceBuilder* builder) {
  Light light;
  light.indoors = true;
  return builder->Build(1, light);
}

TEST(Furniture, MachinesOfOneDesignAreAlike) {
  PlaceBuilder builder(1);
  AddVendingMachine(At(0, 0), 7, &builder);
  AddVendingMachine(At(20, 0), 7, &builder);
  AddVendingMachine(At(40, 0), 8, &builder);
  const Place place = Indoors(&builder);
  const cv::Mat3f machine = Front(place, At(0, 0));
  EXPECT_LT(Difference(machine, Front(place, At(20, 0))), 0.5);
  EXPECT_GT(Difference(machine, Front(place, At(40, 0))), 10);
}

TEST(Furniture, TablesAreAlike) {
  PlaceBuilder builder(1);
  AddTables(At(0, 0), 2, 1, 7, &builder);
  AddTables(At(20, 0), 2, 1, 7, &builder);
  AddTables(At(40, 0), 2, 1, 8, &builder);
  const Place place = Indoors(&builder);
  const cv::Mat3f tables = Front(place, At(1, 0));
  EXPECT_LT(Difference(tables, Front(place, At(21, 0))), 0.5);
  EXPECT_GT(Difference(tables, Front(place, At(41, 0))), 5);
}

}  // namespace furniture_test
}  // namespace skein::sim
