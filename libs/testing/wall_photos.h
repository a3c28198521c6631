// Photos and depth maps of a flat, textured wall, for tests.
#pragma once

#include <cmath>
#include <cstdint>

#include "depth/depth_map.h"

namespace skein::depth_test {

// A grey value at each point of a plane, smooth over half a unit of `u` and `v`.
inline double WallGrey(double u, double v) {
  const auto lattice = [](int64_t x, int64_t y) {
    uint64_t h = static_cast<uint64_t>(x) * 0x9E3779B97F4A7C15ULL +
                 static_cast<uint64_t>(y) * 0xC2B2AE3D27D4EB4FULL;
    h = (h ^ (h >> 29)) * 0xBF58476D1CE4E5B9ULL;
    return static_cast<double>((h ^ (h >> 32)) & 0xff);
  };
  const double x = std::floor(u), y = std::floor(v), a = u - x, b = v - y;
  const auto at = [&](int i, int j) {
    return lattice(static_cast<int64_t>(x) + i, static_cast<int64_t>(y) + j);
  };
  return (1 - b) * ((1 - a) * at(0, 0) + a * at(1, 0)) + b * ((1 - a) * at(0, 1) + a * at(1, 1));
}

constexpr int kWallWidth = 160, kWallHeight = 120;

inline DepthCamera WallCamera() { return {kWallWidth, kWallHeight, {150, 150}, {80, 60}}; }

// The wall z = distance + slope * x of the world.
struct Wall {
  double distance = 10, slope = 0.3;
  double texture = 8;  // lattice points a unit; 0: the wall is blank
  DepthCamera camera = WallCamera();

  double Depth(const DepthPose& pose, const Eigen::Vector2d& ray) const {
    const Eigen::Vector3d centre = pose.Centre();
    const Eigen::Vector3d direction = pose.rotation.transpose() * ray.homogeneous();
    return (distance + slope * centre.x() - centre.z()) / (direction.z() - slope * direction.x());
  }

  DepthPhoto Photo(const DepthPose& pose) const {
    DepthPhoto photo{cv::Mat1b(camera.height, camera.width), {}, camera, pose};
    for (int y = 0; y < camera.height; ++y) {
      for (int x = 0; x < camera.width; ++x) {
        const Eigen::Vector2d ray = photo.camera.Ray({x + 0.5, y + 0.5});
        const Eigen::Vector3d point = pose.ToWorld(Depth(pose, ray) * ray.homogeneous());
        photo.grey(y, x) =
            texture > 0 ? static_cast<uint8_t>(WallGrey(texture * point.x(), texture * point.y()))
                        : uint8_t{128};
      }
    }
    return photo;
  }

  // The true depths of a photo.
  DepthMap Map(const DepthPose& pose, float error) const {
    DepthMap map{camera, pose, cv::Mat1f(camera.height, camera.width),
                 cv::Mat1f(camera.height, camera.width, error)};
    for (int y = 0; y < camera.height; ++y) {
      for (int x = 0; x < camera.width; ++x) {
        map.depth(y, x) = static_cast<float>(Depth(pose, map.camera.Ray({x + 0.5, y + 0.5})));
      }
    }
    return map;
  }
};

// A camera at `centre`, turned by `roll_rad` about its axis and then by `turn_rad` about y.
inline DepthPose PoseAt(const Eigen::Vector3d& centre, double turn_rad = 0, double roll_rad = 0) {
  const Eigen::Matrix3d rotation = (Eigen::AngleAxisd(roll_rad, Eigen::Vector3d::UnitZ()) *
                                    Eigen::AngleAxisd(turn_rad, Eigen::Vector3d::UnitY()))
                                       .toRotationMatrix();
  return {rotation, -rotation * centre};
}

}  // namespace skein::depth_test
