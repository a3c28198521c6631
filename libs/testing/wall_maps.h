// Depth maps of a wall with a colour, for tests.
#pragma once

#include "depth/coloured_map.h"
#include "testing/wall_photos.h"

namespace skein::surface_test {

using depth_test::PoseAt;
using depth_test::Wall;

// Blue, green, red.
const cv::Vec3b kWallColour(10, 20, 30);

struct WallMap {
  explicit WallMap(const DepthPose& pose, float error = 0.02f)
      : map(Wall().Map(pose, error)), colours(map.depth.size(), kWallColour) {}

  ColouredMap Coloured() const { return {&map, &colours, nullptr}; }

  DepthMap map;
  cv::Mat3b colours;
};

// Distance of a point from the wall, along its normal.
inline double DistanceFromWall(const Eigen::Vector3d& point) {
  const Wall wall;
  return std::abs(point.z() - wall.distance - wall.slope * point.x()) / std::hypot(1.0, wall.slope);
}

// Unit, towards the cameras.
inline Eigen::Vector3d WallNormal() { return Eigen::Vector3d(Wall().slope, 0, -1).normalized(); }

}  // namespace skein::surface_test
