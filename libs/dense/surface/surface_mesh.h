// A triangle mesh with a colour and a normal at each vertex.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

namespace skein {

struct MeshVertex {
  Eigen::Vector3f position;         // from the mesh's origin
  Eigen::Vector3f normal;           // unit, away from what is solid
  std::array<uint8_t, 3> colour{};  // red, green, blue; sRGB
};

struct SurfaceMesh {
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();  // in the frame of the maps' poses
  std::vector<MeshVertex> vertices;
  // Indices of three vertices a triangle, counter-clockwise as seen from where the normals point.
  std::vector<uint32_t> indices;

  // In the frame of the maps' poses.
  Eigen::Vector3d Position(const MeshVertex& vertex) const {
    return origin + vertex.position.cast<double>();
  }
  int64_t NumTriangles() const { return static_cast<int64_t>(indices.size() / 3); }
};

}  // namespace skein
