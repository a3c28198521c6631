// A part of a submap's surface as triangles, as a browser reads it (services/web/README.md).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/bytes.h"
#include "core/result.h"

namespace skein {

struct MeshChunk {
  // Indices have 16 bits.
  static constexpr uint32_t kMaxVertices = 1 << 16, kMaxTriangles = 1 << 18;

  // Position = origin + step * xyz, in the submap's frame.
  struct Vertex {
    std::array<uint16_t, 3> xyz{};
    std::array<uint8_t, 3> rgb{};  // sRGB
  };
  // Indices of vertices, counter-clockwise as seen from outside.
  using Triangle = std::array<uint16_t, 3>;

  std::array<double, 3> origin{};
  double step = 0;
  uint64_t version = 0;
  std::vector<Vertex> vertices;
  std::vector<Triangle> triangles;
};

// "SKT1", uint32 number of vertices, uint32 number of triangles, 3 float64 origin, float64 step,
// uint64 version; 9 bytes a vertex, 6 bytes a triangle.
constexpr size_t kMeshChunkHeaderBytes = 52, kMeshVertexBytes = 9, kMeshTriangleBytes = 6;
constexpr size_t MeshChunkBytes(size_t num_vertices, size_t num_triangles) {
  return kMeshChunkHeaderBytes + kMeshVertexBytes * num_vertices +
         kMeshTriangleBytes * num_triangles;
}

// Throws std::invalid_argument for more vertices or triangles than a chunk may have.
Bytes EncodeMeshChunk(const MeshChunk& chunk);
// kDataLoss: another size than that of the header's numbers, or an index of no vertex.
Result<MeshChunk> DecodeMeshChunk(const Bytes& bytes);

}  // namespace skein
