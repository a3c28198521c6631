#include "depth/neighbours.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>

#include "testing/wall_photos.h"

namespace skein::depth_test {
namespace {

// Points ten units in front of the origin.
std::vector<Eigen::Vector3d> Points() {
  std::vector<Eigen::Vector3d> points;
  for (int i = 0; i < 100; ++i) points.emplace_back(0.1 * (i % 10), 0.1 * (i / 10), 10 + 0.01 * i);
  return points;
}

SparsePhoto PhotoAt(double x, int num_points = 100) {
  SparsePhoto photo{PoseAt({x, 0, 0}), std::vector<int>(num_points)};
  std::iota(photo.points.begin(), photo.points.end(), 0);
  return photo;
}

TEST(ChooseNeighbours, PrefersAnglesThatAreGood) {
  // 0.3, 12, 60 degrees.
  const std::vector<SparsePhoto> photos = {PhotoAt(0), PhotoAt(0.05), PhotoAt(2.1), PhotoAt(17)};
  EXPECT_EQ(ChooseNeighbours(photos, Points(), 0, 3), std::vector<int>{2});
}

TEST(ChooseNeighbours, PrefersCommonPoints) {
  const std::vector<SparsePhoto> photos = {PhotoAt(0), PhotoAt(2, 20), PhotoAt(-2, 90),
                                           PhotoAt(3, 5)};
  EXPECT_EQ(ChooseNeighbours(photos, Points(), 0, 3), (std::vector<int>{2, 1}));
}

TEST(ChooseNeighbours, PrefersPhotosFromDifferentPlaces) {
  const std::vector<SparsePhoto> photos = {PhotoAt(0), PhotoAt(2), PhotoAt(2.05, 99),
                                           PhotoAt(-2, 80)};
  EXPECT_EQ(ChooseNeighbours(photos, Points(), 0, 2), (std::vector<int>{1, 3}));
}

// As of a photo whose right half is seen by many photos, its left half by one.
TEST(ChooseNeighbours, CoverThePhotoTogether) {
  SparsePhoto left = PhotoAt(-2.5);
  left.points.erase(left.points.begin() + 40, left.points.end());
  const auto right = [](double x) {
    SparsePhoto photo = PhotoAt(x);
    photo.points.erase(photo.points.begin(), photo.points.begin() + 40);
    return photo;
  };
  const std::vector<SparsePhoto> photos = {PhotoAt(0), right(2), right(3), right(4), left};
  const std::vector<int> chosen = ChooseNeighbours(photos, Points(), 0, 2);
  ASSERT_EQ(chosen.size(), 2u);
  EXPECT_EQ(chosen[1], 4);
}

TEST(ChooseNeighbours, APureRotationHasNone) {
  const std::vector<SparsePhoto> photos = {PhotoAt(0), PhotoAt(0), PhotoAt(0)};
  EXPECT_TRUE(ChooseNeighbours(photos, Points(), 0, 3).empty());
}

TEST(ChooseNeighbours, OnePhotoHasNone) {
  EXPECT_TRUE(ChooseNeighbours({PhotoAt(0)}, Points(), 0, 3).empty());
}

TEST(RangeOfPoints, HoldsThePointsButNotAnOutlier) {
  std::vector<Eigen::Vector3d> points = Points();
  points.resize(300, Eigen::Vector3d(0, 0, 12));
  points.back().z() = 1e6;
  points.front().z() = 0.01;
  const auto range = RangeOfPoints(PhotoAt(0, 300), points);
  ASSERT_TRUE(range);
  EXPECT_LT(range->near, 10.02);
  EXPECT_GT(range->near, 8);
  EXPECT_GT(range->far, 12);
  EXPECT_LT(range->far, 15);
}

TEST(RangeOfPoints, APointAtInfinityIsNone) {
  std::vector<Eigen::Vector3d> points = Points();
  points[50].z() = HUGE_VAL;
  const auto range = RangeOfPoints(PhotoAt(0, 60), points);
  ASSERT_TRUE(range);
  EXPECT_LT(range->far, 15);
}

TEST(RangeOfPoints, ThereIsNoneWithoutPointsInFront) {
  EXPECT_FALSE(RangeOfPoints(PhotoAt(0, 0), Points()));
  SparsePhoto back = PhotoAt(0);
  back.cam_from_world = PoseAt({0, 0, 0}, 3.14159);
  EXPECT_FALSE(RangeOfPoints(back, Points()));
}

}  // namespace
}  // namespace skein::depth_test
