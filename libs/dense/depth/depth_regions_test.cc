#include "depth/depth_regions.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "testing/wall_photos.h"

namespace skein::depth_test {
namespace {

constexpr int kPhotoWidth = 640, kPhotoHeight = 480;
const DepthCamera kPhotoCamera{kPhotoWidth, kPhotoHeight, {550, 550}, {320, 240}};
const SweepPlanes kWholeSearch{1 / 20.0, 1 / 0.5};

DepthPhoto BlackPhoto() {
  return {cv::Mat1b(kPhotoHeight, kPhotoWidth, uint8_t{0}), {}, kPhotoCamera, PoseAt({0, 0, 0})};
}

// A map of half the size, with the inverse depth of each ray.
DepthMap CoarseMap(const std::function<double(const Eigen::Vector2d& ray)>& inverse) {
  const DepthPhoto half = Halved(BlackPhoto());
  DepthMap map{half.camera, half.cam_from_world, cv::Mat1f(half.grey.size()),
               cv::Mat1f(half.grey.size(), 0.01f)};
  for (int y = 0; y < map.depth.rows; ++y) {
    for (int x = 0; x < map.depth.cols; ++x) {
      map.depth(y, x) = static_cast<float>(1 / inverse(half.camera.Ray({x + 0.5, y + 0.5})));
    }
  }
  return map;
}

// The search of a neighbour one unit aside.
double SearchOf(const cv::Rect&, const SweepPlanes& planes) {
  return kPhotoCamera.focal_px.x() * (planes.last - planes.first);
}

std::vector<DepthRegion> RegionsOf(const DepthMap& coarse) {
  return skein::RegionsOf(BlackPhoto(), coarse, kWholeSearch, 128, SearchOf);
}

void ExpectToCoverThePhoto(const std::vector<DepthRegion>& regions) {
  cv::Mat1b covered(kPhotoHeight, kPhotoWidth, uint8_t{0});
  for (const DepthRegion& region : regions) covered(region.area) += 1;
  EXPECT_EQ(cv::countNonZero(covered != 1), 0);
}

bool Searches(const DepthRegion& region, const Eigen::Vector2d& ray, double inverse) {
  return std::any_of(region.families.begin(), region.families.end(),
                     [&](const SweepPlanes& planes) {
                       const double offset = inverse - planes.InverseDepth(ray, 0);
                       return offset >= planes.first && offset <= planes.last;
                     });
}

TEST(RegionsOf, OneIsEnoughForAWall) {
  const auto regions = RegionsOf(CoarseMap([](const auto&) { return 0.2; }));
  ASSERT_EQ(regions.size(), 1u);
  EXPECT_LT(SearchOf(regions[0].area, regions[0].families[0]), 40);
  EXPECT_TRUE(Searches(regions[0], {0, 0}, 0.2));
}

// A floor 1.5 units below the camera, which the whole photo shows at 1 to 15 units.
TEST(RegionsOf, AFloorIsSearchedByPlanesParallelToIt) {
  const auto floor = [](const Eigen::Vector2d& ray) { return (ray.y() + 0.5) / 1.5; };
  const auto regions = RegionsOf(CoarseMap(floor));
  ASSERT_EQ(regions.size(), 1u);
  EXPECT_LT(SearchOf(regions[0].area, regions[0].families[0]), 40);
  EXPECT_NEAR(regions[0].families[0].slope.y(), 1 / 1.5, 1e-3);
  EXPECT_TRUE(Searches(regions[0], {0.1, 0.3}, floor({0.1, 0.3})));
}

// Ground 1.5 units below the camera up to a wall 10 units away: parallel to the ground, the wall is
// 13 times as many planes as parallel to itself.
TEST(RegionsOf, GroundAndWallAreSearchedByPlanesOfTheirOwn) {
  const auto yard = [](const Eigen::Vector2d& ray) { return std::max(0.1, ray.y() / 1.5); };
  const auto regions = RegionsOf(CoarseMap(yard));
  ASSERT_EQ(regions.size(), 1u);
  ASSERT_EQ(regions[0].families.size(), 2u);
  for (const SweepPlanes& planes : regions[0].families) {
    EXPECT_LT(SearchOf(regions[0].area, planes), 64);
    EXPECT_LT(std::min(std::abs(planes.slope.y()), std::abs(planes.slope.y() - 1 / 1.5)), 0.01);
  }
  for (const Eigen::Vector2d& ray : {Eigen::Vector2d(0.2, 0.4), Eigen::Vector2d(-0.3, -0.3)}) {
    EXPECT_TRUE(Searches(regions[0], ray, yard(ray)));
  }
}

// As a room: a table at one unit before walls of all directions.
TEST(RegionsOf, ALongSearchIsSplit) {
  const auto room = [](const Eigen::Vector2d& ray) {
    return ray.x() > 0.1 && ray.y() > 0.1 ? 1.0 : 0.1 + 0.1 * std::sin(9 * ray.x());
  };
  const auto regions = RegionsOf(CoarseMap(room));
  ExpectToCoverThePhoto(regions);
  EXPECT_GT(regions.size(), 4u);
  for (const DepthRegion& region : regions) {
    EXPECT_GE(std::min(region.area.width, region.area.height), kMinRegionPx);
    const Eigen::Vector2d ray =
        kPhotoCamera.Ray(Eigen::Vector2d(region.area.x + region.area.width / 2.0 + 0.5,
                                         region.area.y + region.area.height / 2.0 + 0.5));
    EXPECT_TRUE(Searches(region, ray, room(ray)));
  }
}

TEST(RegionsOf, WithoutCoarseDepthsAllIsSearched) {
  DepthMap holes = CoarseMap([](const auto&) { return 0.2; });
  holes.depth = 0;
  const auto regions = RegionsOf(holes);
  ExpectToCoverThePhoto(regions);
  for (const DepthRegion& region : regions) {
    EXPECT_EQ(region.families[0].first, kWholeSearch.first);
    EXPECT_EQ(region.families[0].last, kWholeSearch.last);
  }
}

// As around the point that a camera moves towards.
TEST(RegionsOf, WithoutParallaxAllIsSearched) {
  const DepthMap coarse = CoarseMap([](const auto&) { return 0.2; });
  const auto none = [](const cv::Rect&, const SweepPlanes&) { return 0.0; };
  const auto regions = skein::RegionsOf(BlackPhoto(), coarse, kWholeSearch, 128, none);
  ASSERT_EQ(regions.size(), 1u);
  EXPECT_EQ(regions[0].families[0].last, kWholeSearch.last);
}

TEST(Halved, ShowsTheSameRays) {
  DepthPhoto photo = BlackPhoto();
  photo.valid = cv::Mat1b(kPhotoHeight, kPhotoWidth, 255);
  photo.valid.colRange(0, 101) = 0;
  const DepthPhoto half = Halved(photo);
  EXPECT_EQ(half.grey.size(), cv::Size(kPhotoWidth / 2, kPhotoHeight / 2));
  EXPECT_TRUE(half.camera.Ray({100, 50}).isApprox(photo.camera.Ray({200, 100})));
  EXPECT_EQ(cv::countNonZero(half.valid.row(0)), kPhotoWidth / 2 - 51);
}

TEST(Cropped, ShowsTheSameRays) {
  const DepthPhoto part = Cropped(BlackPhoto(), cv::Rect(30, 40, 50, 60));
  EXPECT_EQ(part.grey.size(), cv::Size(50, 60));
  EXPECT_TRUE(part.camera.Ray({1, 2}).isApprox(kPhotoCamera.Ray({31, 42})));
}

}  // namespace
}  // namespace skein::depth_test
