// Points and faces of the PLY files that Skein writes.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

namespace skein {

struct PlyMesh {
  std::vector<Eigen::Vector3d> vertices;
  std::vector<std::vector<uint32_t>> faces;  // indices of the vertices; empty: points alone
};

// `file`: ASCII or little-endian, vertices that begin with x y z as floats, faces of 3 to 64
// corners (`skein sim`, `skein export`). Throws std::runtime_error for another.
PlyMesh ReadPlyMesh(const std::string& file);

}  // namespace skein
