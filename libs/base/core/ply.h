// Binary PLY files: the part that points and meshes have in common.
#pragma once

#include <cstddef>
#include <string>

namespace skein {

// The header of little-endian vertices x, y, z (float), nx, ny, nz (float) if they have normals,
// red, green, blue (uchar). Faces may follow; the caller ends it with "end_header\n".
inline std::string PlyHeader(size_t num_vertices, bool has_normals) {
  std::string header = "ply\nformat binary_little_endian 1.0\nelement vertex " +
                       std::to_string(num_vertices) +
                       "\nproperty float x\nproperty float y\nproperty float z\n";
  if (has_normals) header += "property float nx\nproperty float ny\nproperty float nz\n";
  return header + "property uchar red\nproperty uchar green\nproperty uchar blue\n";
}

}  // namespace skein
