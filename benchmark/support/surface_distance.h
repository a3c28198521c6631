// Distance of points to a mesh of flat convex faces.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <string>
#include <unsupported/Eigen/BVH>
#include <vector>

#include "benchmark/support/ply_mesh.h"

namespace skein {

class SurfaceDistance {
 public:
  // Throws std::runtime_error for a mesh without faces.
  explicit SurfaceDistance(const PlyMesh& mesh);
  explicit SurfaceDistance(const std::string& file) : SurfaceDistance(ReadPlyMesh(file)) {}

  // To the nearest surface, in the mesh's unit.
  double operator()(const Eigen::Vector3d& point) const;

 private:
  struct Triangle {
    Eigen::Vector3d a, b, c;

    friend Eigen::AlignedBox3d bounding_box(const Triangle& triangle) {  // Eigen's name
      return Eigen::AlignedBox3d(triangle.a).extend(triangle.b).extend(triangle.c);
    }
  };
  struct Nearest;

  Eigen::KdBVH<double, 3, Triangle> triangles_;
};

// `count` points on the faces, as many a unit of area everywhere. A function of its arguments.
std::vector<Eigen::Vector3d> SampleByArea(const PlyMesh& mesh, size_t count);

}  // namespace skein
