#include "depth/coloured_map.h"

#include <gtest/gtest.h>

#include "testing/wall_maps.h"

namespace skein::surface_test {

TEST(ColouredMap, APhotoShowsTheNearestSurfaceAlone) {
  const WallMap wall(PoseAt({0, 0, 0}));
  const Eigen::Vector3d point = wall.map.Point(80, 60);
  const auto pixel = PixelThatShows(wall.Coloured(), point);
  ASSERT_TRUE(pixel);
  EXPECT_NEAR((*pixel - Eigen::Vector2d(80.5, 60.5)).norm(), 0, 1e-4);
  EXPECT_TRUE(PixelThatShows(wall.Coloured(), 1.003 * point));
  EXPECT_FALSE(PixelThatShows(wall.Coloured(), 1.01 * point)) << "a wall behind the dolphin";
  EXPECT_FALSE(PixelThatShows(wall.Coloured(), -point));
}

TEST(ColouredMap, MaskedPixelsAndBordersShowNothing) {
  const WallMap wall(PoseAt({0, 0, 0}));
  cv::Mat1b mask(wall.map.depth.size(), 255);
  mask(60, 80) = 0;
  ColouredMap map = wall.Coloured();
  map.mask = &mask;
  EXPECT_FALSE(PixelThatShows(map, wall.map.Point(80, 60)));
  EXPECT_FALSE(PixelThatShows(map, wall.map.Point(79, 59))) << "its neighbour is masked";
  EXPECT_TRUE(PixelThatShows(map, wall.map.Point(90, 60)));
  EXPECT_FALSE(PixelThatShows(map, wall.map.Point(0, 60)));
}

}  // namespace skein::surface_test
