// Planes that many depths of a photo lie on.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

namespace skein {

// An inverse depth at a ray (DepthCamera::Ray).
struct InverseDepth {
  Eigen::Vector2d ray = Eigen::Vector2d::Zero();
  double inverse = 0;
};

// A plane of space is a linear function of the ray: inverse depth = plane . (ray, 1).
struct FoundPlane {
  Eigen::Vector3d plane = Eigen::Vector3d::Zero();
  std::vector<InverseDepth> on;  // depths on it
};

struct FoundPlanes {
  std::vector<FoundPlane> planes;
  std::vector<InverseDepth> left;  // depths on no plane
};

struct PlaneSearch {
  double tolerance = 0;  // of inverse depth, by which a depth on a plane may be off it
  double first = 0;      // part of the depths that lie on the first plane, at least
  double next = 0;       // and on each next one
  int triples = 0;       // that are tried for each plane
};

// RANSAC (Fischler and Bolles 1981), the plane with most depths first, kMaxPlanes at most. A depth
// within twice the tolerance of a plane is no part of the next ones. Only kMaxPlaneSamples of the
// depths, evenly spaced, are looked at: `on` and `left` are of these.
constexpr size_t kMaxPlanes = 3, kMaxPlaneSamples = 400;
FoundPlanes FindPlanes(const std::vector<InverseDepth>& depths, const PlaneSearch& search);

}  // namespace skein
