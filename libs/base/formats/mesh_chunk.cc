#include "formats/mesh_chunk.h"

#include <algorithm>
#include <stdexcept>
#include <string>

#include "formats/encoding.h"

namespace skein {
namespace {

using namespace encoding;

constexpr char kMeshChunk[] = "SKT1";

bool GetMeshVertex(ByteReader* reader, MeshChunk::Vertex* vertex) {
  return GetArray(reader, &vertex->xyz) && GetArray(reader, &vertex->rgb);
}

bool GetTriangle(ByteReader* reader, size_t num_vertices, MeshChunk::Triangle* triangle) {
  return GetArray(reader, triangle) &&
         std::all_of(triangle->begin(), triangle->end(),
                     [num_vertices](uint16_t index) { return index < num_vertices; });
}

}  // namespace

Bytes EncodeMeshChunk(const MeshChunk& chunk) {
  if (chunk.vertices.size() > MeshChunk::kMaxVertices ||
      chunk.triangles.size() > MeshChunk::kMaxTriangles) {
    throw std::invalid_argument("mesh chunk too large");
  }
  ByteWriter writer;
  writer.PutRaw(kMeshChunk, 4);
  writer.Put(static_cast<uint32_t>(chunk.vertices.size()));
  writer.Put(static_cast<uint32_t>(chunk.triangles.size()));
  PutArray(&writer, chunk.origin);
  writer.Put(chunk.step);
  writer.Put(chunk.version);
  for (const MeshChunk::Vertex& vertex : chunk.vertices) {
    PutArray(&writer, vertex.xyz);
    PutArray(&writer, vertex.rgb);
  }
  for (const MeshChunk::Triangle& triangle : chunk.triangles) PutArray(&writer, triangle);
  return writer.Take();
}

Result<MeshChunk> DecodeMeshChunk(const Bytes& bytes) {
  const Status damaged = DataLoss(std::string(kMeshChunk) + ": not the bytes of a mesh chunk");
  ByteReader reader(bytes);
  char identifier[4];
  uint32_t num_vertices = 0, num_triangles = 0;
  MeshChunk chunk;
  const bool has_header = reader.GetRaw(identifier, 4) &&
                          std::string(identifier, 4) == kMeshChunk && reader.Get(&num_vertices) &&
                          reader.Get(&num_triangles) && GetArray(&reader, &chunk.origin) &&
                          reader.Get(&chunk.step) && reader.Get(&chunk.version);
  if (!has_header || num_vertices > MeshChunk::kMaxVertices ||
      num_triangles > MeshChunk::kMaxTriangles ||
      bytes.size() != MeshChunkBytes(num_vertices, num_triangles)) {
    return damaged;
  }
  chunk.vertices.resize(num_vertices);
  for (MeshChunk::Vertex& vertex : chunk.vertices) GetMeshVertex(&reader, &vertex);
  chunk.triangles.resize(num_triangles);
  for (MeshChunk::Triangle& triangle : chunk.triangles) {
    if (!GetTriangle(&reader, num_vertices, &triangle)) return damaged;
  }
  return chunk;
}

}  // namespace skein
