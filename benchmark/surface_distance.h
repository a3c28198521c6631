// Distance of points to a mesh of flat convex faces.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <string>
#include <vector>

namespace skein {

class SurfaceDistance {
 public:
  // `file`: ASCII PLY with vertices x y z and faces of at least three corners (as `skein sim`
  // writes it). Throws std::runtime_error for another.
  explicit SurfaceDistance(const std::string& file);

  // To the nearest surface, in the mesh's unit.
  double operator()(const Eigen::Vector3d& point) const;

 private:
  struct Triangle {
    Eigen::Vector3d a, b, c;
    Eigen::AlignedBox3d box;
  };
  void AddFace(const std::vector<Eigen::Vector3d>& corners);

  std::vector<Triangle> triangles_;
};

}  // namespace skein
