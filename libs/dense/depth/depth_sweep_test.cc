#include "depth/depth_sweep.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <opencv2/imgproc.hpp>
#include <stdexcept>

#include "depth/consistency.h"
#include "testing/wall_photos.h"

namespace skein::depth_test {
namespace {

const DepthRange kRange{7, 16};

struct Quality {
  double found = 0;  // part of the pixels
  double right = 0;  // part of the found ones: within 1 %
};

Quality QualityOf(const DepthMap& map, const Wall& wall) {
  int found = 0, right = 0;
  for (int y = 0; y < map.depth.rows; ++y) {
    for (int x = 0; x < map.depth.cols; ++x) {
      if (!(map.depth(y, x) > 0)) continue;
      const double truth = wall.Depth(map.cam_from_world, map.camera.Ray({x + 0.5, y + 0.5}));
      ++found;
      right += std::abs(map.depth(y, x) - truth) < 0.01 * truth;
    }
  }
  return {static_cast<double>(found) / map.depth.total(),
          found == 0 ? 0 : static_cast<double>(right) / found};
}

DepthMap MapOf(const Wall& wall, const std::vector<DepthPose>& neighbours,
               InstructionSet kernel = FastestInstructionSet(), const DepthRange& range = kRange) {
  std::vector<DepthPhoto> photos;
  for (const DepthPose& pose : neighbours) photos.push_back(wall.Photo(pose));
  std::vector<const DepthPhoto*> pointers;
  for (const DepthPhoto& photo : photos) pointers.push_back(&photo);
  return *DepthSweep(kernel).Estimate(wall.Photo(PoseAt({0, 0, 0})), pointers, range);
}

const std::vector<DepthPose> kAround = {PoseAt({2, 0, 0}, -0.15), PoseAt({-2, 0, 0}, 0.15),
                                        PoseAt({0, 1.8, 0})};

TEST(DepthSweep, FindsASlantedWall) {
  const Quality quality = QualityOf(MapOf({}, kAround), {});
  EXPECT_GT(quality.found, 0.85);
  EXPECT_GT(quality.right, 0.95);
}

// As in a room: 128 planes from the table to the wall would be 11 % of its depth apart.
TEST(DepthSweep, FindsAFarWallThoughSomethingMayBeNear) {
  Wall wall;
  wall.camera = {320, 240, {300, 300}, {160, 120}};
  const Quality quality = QualityOf(MapOf(wall, kAround, FastestInstructionSet(), {0.7, 30}), wall);
  EXPECT_GT(quality.found, 0.85);
  EXPECT_GT(quality.right, 0.95);
}

TEST(DepthSweep, TakesNeighboursThatAreTurnedNearerAndFarther) {
  const std::vector<DepthPose> poses = {
      PoseAt({1.5, 0, 1.5}, 0, 1.2), PoseAt({-1.5, 0, -1.5}, 0, -1.5), PoseAt({0, 1.8, 0}, 0, 3)};
  const Quality quality = QualityOf(MapOf({}, poses), {});
  EXPECT_GT(quality.found, 0.7);
  EXPECT_GT(quality.right, 0.9);
}

// As a floor that the camera looks along: a neighbour's pixels are moved apart.
TEST(DepthSweep, FindsAPlaneAtAGrazingAngleThatPointsLieOn) {
  const Wall floor{10, -8};
  const std::vector<DepthPose> around = {PoseAt({1, 0, 0}), PoseAt({-1, 0, 0}), PoseAt({0, 1, 0})};
  const DepthRange range{1.5, 20}, with_plane{1.5, 20, {{0.8, 0, 0.1}}};
  const auto quality = [&](const DepthRange& searched) {
    return QualityOf(MapOf(floor, around, FastestInstructionSet(), searched), floor);
  };
  EXPECT_LT(quality(range).found * quality(range).right, 0.3);
  EXPECT_GT(quality(with_plane).found, 0.5);
  EXPECT_GT(quality(with_plane).right, 0.9);
}

TEST(DepthSweep, PredictsItsErrorWithinAFactorOfFour) {
  const Wall wall;
  const DepthMap map = MapOf(wall, kAround);
  std::vector<double> ratios;
  for (int y = 0; y < map.depth.rows; ++y) {
    for (int x = 0; x < map.depth.cols; ++x) {
      if (!(map.depth(y, x) > 0)) continue;
      const double truth = wall.Depth(map.cam_from_world, map.camera.Ray({x + 0.5, y + 0.5}));
      ratios.push_back(std::abs(map.depth(y, x) - truth) / map.error(y, x));
    }
  }
  ASSERT_FALSE(ratios.empty());
  std::nth_element(ratios.begin(), ratios.begin() + ratios.size() * 68 / 100, ratios.end());
  const double ratio = ratios[ratios.size() * 68 / 100];
  EXPECT_GT(ratio, 1.0 / 4);
  EXPECT_LT(ratio, 4);
}

TEST(DepthSweep, EveryKernelGivesTheSameMap) {
  const Wall wall;
  const DepthMap portable = MapOf(wall, kAround, InstructionSet::kPortable);
  for (const InstructionSet version : kInstructionSets) {
    if (!IsInstructionSetSupported(version)) continue;
    const DepthMap map = MapOf(wall, kAround, version);
    EXPECT_EQ(cv::countNonZero(map.depth != portable.depth), 0) << InstructionSetName(version);
    EXPECT_EQ(cv::countNonZero(map.error != portable.error), 0) << InstructionSetName(version);
  }
}

TEST(DepthSweep, WorkingMemoryKeepsNothingOfTheLastPhoto) {
  const Wall wall, other{12, -0.2};
  const DepthPhoto photo = wall.Photo(PoseAt({0, 0, 0})), neighbour = wall.Photo(kAround[0]);
  DepthSweep sweep;
  const DepthMap first = *sweep.Estimate(photo, {&neighbour}, kRange);
  const DepthPhoto a = other.Photo(PoseAt({0, 0, 0})), b = other.Photo(kAround[1]);
  sweep.Estimate(a, {&b, &b}, {3, 40});
  const DepthMap again = *sweep.Estimate(photo, {&neighbour}, kRange);
  EXPECT_EQ(cv::countNonZero(first.depth != again.depth), 0);
}

TEST(DepthSweep, ABlankWallIsAHole) { EXPECT_EQ(MapOf({10, 0.3, 0}, kAround).Completeness(), 0); }

// A wall below a line of the wall's plane, and the sky above it, as a photo shows its blurred edge.
DepthPhoto UnderSky(const Wall& wall, const DepthPose& pose, cv::Mat1b* is_sky) {
  DepthPhoto photo = wall.Photo(pose);
  is_sky->create(photo.grey.size());
  for (int y = 0; y < photo.grey.rows; ++y) {
    for (int x = 0; x < photo.grey.cols; ++x) {
      const Eigen::Vector2d ray = wall.camera.Ray({x + 0.5, y + 0.5});
      const Eigen::Vector3d point = pose.ToWorld(wall.Depth(pose, ray) * ray.homogeneous());
      (*is_sky)(y, x) = point.y() < -1 + 0.4 * std::abs(point.x()) ? 255 : 0;
    }
  }
  photo.grey.setTo(250, *is_sky);
  cv::blur(photo.grey, photo.grey, {3, 3});
  return photo;
}

TEST(DepthSweep, TheSkyAboveAWallIsAHole) {
  cv::Mat1b is_sky, of_neighbour;
  const DepthPhoto photo = UnderSky(Wall(), PoseAt({0, 0, 0}), &is_sky);
  const DepthPhoto a = UnderSky(Wall(), kAround[0], &of_neighbour);
  const DepthPhoto b = UnderSky(Wall(), kAround[1], &of_neighbour);
  const cv::Mat1b found = DepthSweep().Estimate(photo, {&a, &b}, kRange)->depth > 0;
  EXPECT_GT(cv::countNonZero(found & ~is_sky), 0.8 * cv::countNonZero(~is_sky));
  // Its edge's blur is 1 pixel wide.
  cv::erode(is_sky, is_sky, cv::Mat::ones(5, 5, CV_8U));
  EXPECT_EQ(cv::countNonZero(found & is_sky), 0);
}

// As of sky or water: one sweep finds something, but no two find the same.
TEST(DepthSweep, NoiseIsAllHolesAfterTheCheck) {
  cv::RNG random(1);
  std::vector<DepthPhoto> photos;
  for (const DepthPose& pose : kAround) {
    photos.push_back(Wall().Photo(pose));
    random.fill(photos.back().grey, cv::RNG::UNIFORM, 100, 140);
  }
  DepthSweep sweep;
  std::vector<DepthMap> maps;
  for (int i = 0; i < 3; ++i) {
    maps.push_back(
        *sweep.Estimate(photos[i], {&photos[(i + 1) % 3], &photos[(i + 2) % 3]}, kRange));
  }
  EXPECT_LT(KeepAgreed(maps[0], {&maps[1], &maps[2]}).Completeness(), 0.02);
}

TEST(DepthSweep, WithoutNeighboursAllIsHoles) { EXPECT_EQ(MapOf({}, {}).Completeness(), 0); }

TEST(DepthSweep, PureRotationIsAllHoles) {
  EXPECT_EQ(MapOf({}, {PoseAt({0, 0, 0}, 0.1), PoseAt({0, 0, 0}, -0.1)}).Completeness(), 0);
}

TEST(DepthSweep, HalfADegreeOfBaselineIsAllHoles) {
  EXPECT_EQ(MapOf({}, {PoseAt({0.087, 0, 0})}).Completeness(), 0);
}

TEST(DepthSweep, ANeighbourThatLooksAwayIsAllHoles) {
  EXPECT_EQ(MapOf({}, {PoseAt({2, 0, 0}, 3.1)}).Completeness(), 0);
}

TEST(DepthSweep, WhatThePhotoDoesNotShowIsAHole) {
  DepthPhoto photo = Wall().Photo(PoseAt({0, 0, 0}));
  photo.valid = cv::Mat1b(photo.grey.size(), 255);
  photo.valid.colRange(0, 80) = 0;
  const DepthPhoto neighbour = Wall().Photo(kAround[0]);
  const DepthMap map = *DepthSweep().Estimate(photo, {&neighbour}, kRange);
  EXPECT_EQ(cv::countNonZero(map.depth.colRange(0, 80)), 0);
  EXPECT_GT(cv::countNonZero(map.depth.colRange(80, 160)), 2000);
}

TEST(DepthSweep, APhotoOfOnePixelIsAHole) {
  DepthPhoto photo{
      cv::Mat1b(1, 1, uint8_t{7}), {}, {1, 1, {150, 150}, {0.5, 0.5}}, PoseAt({0, 0, 0})};
  DepthPhoto neighbour = photo;
  neighbour.cam_from_world = PoseAt({2, 0, 0});
  EXPECT_EQ(DepthSweep().Estimate(photo, {&neighbour}, kRange)->Completeness(), 0);
}

TEST(DepthSweep, StopsWhenAsked) {
  const DepthPhoto photo = Wall().Photo(PoseAt({0, 0, 0})), neighbour = Wall().Photo(kAround[0]);
  int asked = 0;
  const auto stop = [&] { return ++asked == 20; };
  EXPECT_FALSE(DepthSweep().Estimate(photo, {&neighbour}, kRange, stop));
  EXPECT_EQ(asked, 20);
}

TEST(DepthSweep, RefusesUnsoundInput) {
  const DepthPhoto photo = Wall().Photo(PoseAt({0, 0, 0}));
  DepthSweep sweep;
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const DepthRange& range :
       {DepthRange{0, 1}, DepthRange{2, 1}, DepthRange{1, nan}, DepthRange{nan, 1}}) {
    EXPECT_THROW(sweep.Estimate(photo, {}, range), std::invalid_argument);
  }
  DepthPhoto cut = photo;
  cut.grey = cut.grey.rowRange(0, 50);
  EXPECT_THROW(sweep.Estimate(cut, {}, kRange), std::invalid_argument);
  EXPECT_THROW(sweep.Estimate(photo, {&cut}, kRange), std::invalid_argument);
  DepthPhoto lost = photo;
  lost.cam_from_world.translation.x() = nan;
  EXPECT_THROW(sweep.Estimate(photo, {&lost}, kRange), std::invalid_argument);
}

}  // namespace
}  // namespace skein::depth_test
