#include "benchmark/support/surface_distance.h"

#include <algorithm>
#include <cmath>
#include <random>
#include <stdexcept>

namespace skein {
namespace {

double DistanceToSegment(const Eigen::Vector3d& p, const Eigen::Vector3d& a,
                         const Eigen::Vector3d& b) {
  const Eigen::Vector3d ab = b - a;
  const double length2 = ab.squaredNorm();
  const double t = length2 > 0 ? std::clamp((p - a).dot(ab) / length2, 0.0, 1.0) : 0.0;
  return (p - a - t * ab).norm();
}

double DistanceToTriangle(const Eigen::Vector3d& p, const Eigen::Vector3d& a,
                          const Eigen::Vector3d& b, const Eigen::Vector3d& c) {
  const Eigen::Vector3d normal = (b - a).cross(c - a);
  const auto inside = [&](const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
    return normal.cross(to - from).dot(p - from) >= 0;
  };
  if (normal.squaredNorm() > 0 && inside(a, b) && inside(b, c) && inside(c, a)) {
    return std::abs(normal.dot(p - a)) / normal.norm();
  }
  return std::min(
      {DistanceToSegment(p, a, b), DistanceToSegment(p, b, c), DistanceToSegment(p, c, a)});
}

// The faces, each as a fan: calls function(a, b, c).
template <typename Function>
void ForEachTriangle(const PlyMesh& mesh, const Function& function) {
  for (const std::vector<uint32_t>& face : mesh.faces) {
    for (size_t k = 2; k < face.size(); ++k) {
      function(mesh.vertices[face[0]], mesh.vertices[face[k - 1]], mesh.vertices[face[k]]);
    }
  }
}

}  // namespace

// Minimiser for Eigen::BVMinimize: lower bound of the distance for a box, distance for a triangle.
struct SurfaceDistance::Nearest {
  using Scalar = double;
  const Eigen::Vector3d& point;

  double minimumOnVolume(const Eigen::AlignedBox3d& box) const {
    return box.exteriorDistance(point);
  }
  double minimumOnObject(const Triangle& triangle) const {
    return DistanceToTriangle(point, triangle.a, triangle.b, triangle.c);
  }
};

SurfaceDistance::SurfaceDistance(const PlyMesh& mesh) {
  std::vector<Triangle> triangles;
  ForEachTriangle(mesh, [&](const auto& a, const auto& b, const auto& c) {
    triangles.push_back({a, b, c});
  });
  if (triangles.empty()) throw std::runtime_error("a mesh without faces");
  triangles_.init(triangles.begin(), triangles.end());
}

double SurfaceDistance::operator()(const Eigen::Vector3d& point) const {
  Nearest nearest{point};
  return Eigen::BVMinimize(triangles_, nearest);
}

std::vector<Eigen::Vector3d> SampleByArea(const PlyMesh& mesh, size_t count) {
  std::vector<double> areas;
  std::vector<Eigen::Matrix3d> triangles;
  ForEachTriangle(mesh, [&](const auto& a, const auto& b, const auto& c) {
    areas.push_back((b - a).cross(c - a).norm() / 2);
    triangles.emplace_back();
    triangles.back() << a, b - a, c - a;
  });
  std::mt19937_64 random(1);
  std::discrete_distribution<size_t> choose(areas.begin(), areas.end());
  std::uniform_real_distribution<double> part(0, 1);
  std::vector<Eigen::Vector3d> samples;
  while (!areas.empty() && samples.size() < count) {
    double u = part(random), v = part(random);
    if (u + v > 1) {
      u = 1 - u;
      v = 1 - v;
    }
    samples.emplace_back(triangles[choose(random)] * Eigen::Vector3d(1, u, v));
  }
  return samples;
}

}  // namespace skein
