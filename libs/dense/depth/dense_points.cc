#include "depth/dense_points.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "depth/agreement.h"

namespace skein {
namespace {

constexpr float kSameSurface = 0.05f;  // part of the depth between two pixels side by side

class Surface {
 public:
  explicit Surface(const DepthMap& map) : map_(map) {}

  std::optional<Eigen::Vector3d> Normal(int x, int y) const {
    const auto along_x = Slope(x, y, 1, 0), along_y = Slope(x, y, 0, 1);
    if (!along_x || !along_y) return std::nullopt;
    const Eigen::Vector3d normal = along_y->cross(*along_x);
    const double length = normal.norm();
    if (!(length > 0)) return std::nullopt;
    return normal / length;
  }

 private:
  bool IsSameSurface(int x, int y, float depth) const {
    return x >= 0 && y >= 0 && x < map_.depth.cols && y < map_.depth.rows && map_.depth(y, x) > 0 &&
           std::abs(map_.depth(y, x) - depth) <= kSameSurface * depth;
  }

  // From the pixel before to the one after, where they are of the surface.
  std::optional<Eigen::Vector3d> Slope(int x, int y, int dx, int dy) const {
    const float depth = map_.depth(y, x);
    const bool before = IsSameSurface(x - dx, y - dy, depth);
    const bool after = IsSameSurface(x + dx, y + dy, depth);
    if (!before && !after) return std::nullopt;
    const Eigen::Vector3d last = after ? map_.Point(x + dx, y + dy) : map_.Point(x, y);
    return last - (before ? map_.Point(x - dx, y - dy) : map_.Point(x, y));
  }

  const DepthMap& map_;
};

}  // namespace

std::optional<Eigen::Vector3d> NormalAt(const DepthMap& map, int x, int y) {
  return Surface(map).Normal(x, y);
}

std::vector<DensePoint> PointsOf(const DepthMap& map, const cv::Mat3b& colours,
                                 const std::vector<const DepthMap*>& others) {
  std::vector<Agreement> agreements;
  for (const DepthMap* other : others) agreements.emplace_back(map, *other);
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
      points.push_back({point.cast<float>(), (world_from_cam * *normal).cast<float>(),
                        colours(y, x), map.error(y, x) / map.depth(y, x)});
    }
  }
  return points;
}

}  // namespace skein
