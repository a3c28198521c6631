#include "benchmark/support/plane_sweep.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <opencv2/imgproc.hpp>

#include "clients/places/render.h"
#include "core/statistics.h"
#include "testing/test_plate.h"

namespace skein::plane_sweep_test {

constexpr double kWallM = 5, kPlateM = 4;  // along y

sim::Texture Speckled(uint64_t seed) {
  cv::Mat3b picture(512, 512);
  cv::RNG random(seed);
  random.fill(picture, cv::RNG::UNIFORM, 0, 255);
  cv::GaussianBlur(picture, picture, {}, 1.2);
  return sim::Texture(picture, 60, sim::Texture::Edge::kRepeat);
}

// A wall, and a plate before it.
sim::Place WallAndPlate(const sim::Texture& texture) {
  sim::Place place = sim::PlateBeforeWall({0, static_cast<float>(kPlateM), 0}, 1);
  place.textures = {texture, texture};
  return place;
}

// Five photos side by side, 0.35 m apart: 4 degrees at the wall.
std::vector<SweepPhoto> TakePhotos(const sim::Place& place) {
  const sim::Camera camera{240, 180, 206, 0};
  std::vector<SweepPhoto> photos;
  for (int i = 0; i < 5; ++i) {
    const Eigen::Vector3d center(0.35 * (i - 2), 0, 0.1 * (i % 2));
    const sim::Pose pose = sim::LookAt(center, {0.05 * i, kWallM, 0}, 0.02 * i);
    const cv::Mat3b photo = sim::RenderPhoto(place, camera, pose, {});
    SweepPhoto sweep;
    cv::Mat1b grey;
    cv::cvtColor(photo, grey, cv::COLOR_BGR2GRAY);
    grey.convertTo(sweep.grey, CV_32F);
    sweep.focal_px = camera.focal_px;
    sweep.principal_point = camera.PrincipalPoint();
    sweep.cam_from_world = {pose.cam_from_world, pose.Translation()};
    sweep.near = 2.5;
    sweep.far = 8;
    for (int k = 0; k < 5; ++k) {
      if (k != i) sweep.neighbours.push_back(k);
    }
    photos.push_back(sweep);
  }
  return photos;
}

std::vector<Eigen::Vector3d> PointsOfAll(const std::vector<SweepPhoto>& photos) {
  std::vector<cv::Mat1f> depths;
  for (int i = 0; i < 5; ++i) depths.push_back(SweepDepth(photos, i));
  std::vector<Eigen::Vector3d> points;
  for (int i = 0; i < 5; ++i) {
    for (const auto& p : ConsistentPoints(photos, depths, i, photos[i].neighbours)) {
      points.push_back(p);
    }
  }
  return points;
}

TEST(PlaneSweep, FindsAWallAndWhatStandsBeforeIt) {
  const std::vector<Eigen::Vector3d> points = PointsOfAll(TakePhotos(WallAndPlate(Speckled(7))));
  std::vector<double> errors;
  size_t on_plate = 0;
  for (const Eigen::Vector3d& p : points) {
    const double wall = std::abs(p.y() - kWallM), plate = std::abs(p.y() - kPlateM);
    errors.push_back(std::min(wall, plate));
    on_plate += plate < 0.1 && std::max(std::abs(p.x()), std::abs(p.z())) < 0.5;
  }
  const size_t tried = 5 * (240 / 2) * (180 / 2);
  EXPECT_GT(points.size(), tried / 2);
  EXPECT_GT(on_plate, 500u);
  EXPECT_LT(percentile(errors, 50), 0.01);
  EXPECT_LT(percentile(errors, 95), 0.05);
}

TEST(PlaneSweep, ASurfaceWithoutTextureGivesNoPoints) {
  sim::Place place = WallAndPlate(sim::Plain({90, 90, 90}));
  EXPECT_LT(PointsOfAll(TakePhotos(place)).size(), 50u);  // at the plate's edges
}

TEST(PlaneSweep, OneDepthMapAloneGivesNoPoints) {
  std::vector<SweepPhoto> photos = TakePhotos(WallAndPlate(Speckled(7)));
  std::vector<cv::Mat1f> depths(5);
  depths[2] = SweepDepth(photos, 2);
  ASSERT_GT(cv::countNonZero(depths[2]), 10000);
  EXPECT_TRUE(ConsistentPoints(photos, depths, 2, photos[2].neighbours).empty());
}

TEST(PlaneSweep, APhotoWithoutNeighboursHasNoDepth) {
  std::vector<SweepPhoto> photos = TakePhotos(WallAndPlate(Speckled(7)));
  photos[0].neighbours.clear();
  EXPECT_EQ(cv::countNonZero(SweepDepth(photos, 0)), 0);
}

TEST(PlaneSweep, RefusesDepthsThatAreNotSound) {
  std::vector<SweepPhoto> photos = TakePhotos(WallAndPlate(Speckled(7)));
  photos[0].far = photos[0].near;
  EXPECT_THROW(SweepDepth(photos, 0), std::invalid_argument);
}

}  // namespace skein::plane_sweep_test
