#include "depth/dense_points.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "depth/agreement.h"

namespace skein {
namespace {

constexpr float kSameSurface = 0.05f;  // part of the depth between two pixels side by side

bool IsSameSurface(const DepthMap& map, int x, int y, float depth) {
  return x >= 0 && y >= 0 && x < map.depth.cols && y < map.depth.rows && map.depth(y, x) > 0 &&
         std::abs(map.depth(y, x) - depth) <= kSameSurface * depth;
}

// From the pixel before to the one after, where they are of the surface.
std::optional<Eigen::Vector3d> Slope(const DepthMap& map, int x, int y, int dx, int dy) {
  const float depth = map.depth(y, x);
  const bool before = IsSameSurface(map, x - dx, y - dy, depth);
  const bool after = IsSameSurface(map, x + dx, y + dy, depth);
  if (!before && !after) return std::nullopt;
  const Eigen::Vector3d last = after ? map.Point(x + dx, y + dy) : map.Point(x, y);
  return last - (before ? map.Point(x - dx, y - dy) : map.Point(x, y));
}

}  // namespace

std::optional<Eigen::Vector3d> NormalAt(const DepthMap& map, int x, int y) {
  const auto along_x = Slope(map, x, y, 1, 0), along_y = Slope(map, x, y, 0, 1);
  if (!along_x || !along_y) return std::nullopt;
  const Eigen::Vector3d normal = along_y->cross(*along_x);
  const double length = normal.norm();
  if (!(length > 0)) return std::nullopt;
  return normal / length;
}

std::vector<DensePoint> PointsOf(const DepthMap& map, const cv::Mat3b& colours,
                                 const std::vector<const DepthMap*>& others) {
  const std::vector<Agreement> agreements = AgreementsOf(map, others);
  const auto is_shown_better = [&](int x, int y) {
    return std::any_of(agreements.begin(), agreements.end(), [&](const Agreement& agreement) {
      const auto estimate = agreement.Find(x, y, map.depth(y, x));
      return estimate && estimate->error < map.error(y, x);
    });
  };
  const Eigen::Matrix3d world_from_cam = map.cam_from_world.rotation.transpose();
  std::vector<DensePoint> points;
  for (int y = 0; y < map.depth.rows; ++y) {
    for (int x = 0; x < map.depth.cols; ++x) {
      if (!(map.depth(y, x) > 0) || is_shown_better(x, y)) continue;
      const std::optional<Eigen::Vector3d> normal = NormalAt(map, x, y);
      if (!normal) continue;
      const Eigen::Vector3d point = map.cam_from_world.ToWorld(map.Point(x, y));
      points.push_back({point, (world_from_cam * *normal).cast<float>(), colours(y, x),
                        map.error(y, x) / map.depth(y, x)});
    }
  }
  return points;
}

}  // namespace skein
