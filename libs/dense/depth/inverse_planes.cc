#include "depth/inverse_planes.h"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <optional>
#include <random>
#include <utility>

namespace skein {
namespace {

std::vector<InverseDepth> Thinned(const std::vector<InverseDepth>& depths) {
  std::vector<InverseDepth> some;
  const size_t step = depths.size() / kMaxPlaneSamples + 1;
  for (size_t i = 0; i < depths.size(); i += step) some.push_back(depths[i]);
  return some;
}

std::optional<Eigen::Vector3d> PlaneThrough(const InverseDepth& a, const InverseDepth& b,
                                            const InverseDepth& c) {
  Eigen::Matrix3d rows;
  rows << a.ray.homogeneous().transpose(), b.ray.homogeneous().transpose(),
      c.ray.homogeneous().transpose();
  if (std::abs(rows.determinant()) < 1e-9) return std::nullopt;
  return rows.inverse() * Eigen::Vector3d(a.inverse, b.inverse, c.inverse);
}

bool IsOn(const Eigen::Vector3d& plane, const InverseDepth& depth, double most) {
  return std::abs(plane.dot(depth.ray.homogeneous()) - depth.inverse) <= most;
}

// The best plane through three depths that more than `least` lie on; nullopt: none.
std::optional<Eigen::Vector3d> BestOfTriples(const std::vector<InverseDepth>& depths, double least,
                                             const PlaneSearch& search) {
  std::mt19937 random(1);
  const auto pick = [&]() -> const InverseDepth& { return depths[random() % depths.size()]; };
  auto best = static_cast<std::ptrdiff_t>(least);
  std::optional<Eigen::Vector3d> plane;
  for (int i = 0; i < search.triples; ++i) {
    const auto through = PlaneThrough(pick(), pick(), pick());
    if (!through) continue;
    const auto count = std::count_if(depths.begin(), depths.end(), [&](const InverseDepth& depth) {
      return IsOn(*through, depth, search.tolerance);
    });
    if (count <= best) continue;
    best = count;
    plane = *through;
  }
  return plane;
}

// Least squares of the depths that lie on a plane.
Eigen::Vector3d Refined(const Eigen::Vector3d& plane, const std::vector<InverseDepth>& depths,
                        double most) {
  Eigen::Matrix3d a = Eigen::Matrix3d::Identity() * 1e-12;
  Eigen::Vector3d b = Eigen::Vector3d::Zero();
  for (const InverseDepth& depth : depths) {
    if (!IsOn(plane, depth, most)) continue;
    const Eigen::Vector3d ray = depth.ray.homogeneous();
    a += ray * ray.transpose();
    b += depth.inverse * ray;
  }
  return a.ldlt().solve(b);
}

}  // namespace

FoundPlanes FindPlanes(const std::vector<InverseDepth>& depths, const PlaneSearch& search) {
  FoundPlanes found;
  found.left = Thinned(depths);
  const double all = static_cast<double>(found.left.size());
  while (found.planes.size() < kMaxPlanes && found.left.size() >= 3) {
    const double least = all * (found.planes.empty() ? search.first : search.next);
    const auto best = BestOfTriples(found.left, least, search);
    if (!best) break;
    FoundPlane plane{Refined(*best, found.left, search.tolerance), {}};
    const auto off = std::stable_partition(
        found.left.begin(), found.left.end(),
        [&](const InverseDepth& depth) { return !IsOn(plane.plane, depth, 2 * search.tolerance); });
    plane.on.assign(off, found.left.end());
    found.left.erase(off, found.left.end());
    found.planes.push_back(std::move(plane));
  }
  return found;
}

}  // namespace skein
