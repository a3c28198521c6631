#include "formats/dense.h"

#include <algorithm>
#include <cmath>

#include "formats/encoding.h"
#include "formats/mesh_chunk.h"
#include "formats/shape.h"

namespace skein {
namespace {

using namespace encoding;

constexpr char kDenseManifest[] = "SKDM";
constexpr size_t kMinDensePhotoBytes = 4 + 8 + 4 + 4, kMinDenseChunkBytes = 8 + 8 + 4 + 4;
constexpr size_t kFramePhotoBytes = 4 + 7 * 8, kMinMeshChunkBytes = 8 + 8 + 4 + 4 + 4;

bool GetDenseChunk(ByteReader* reader, DenseManifest::Chunk* chunk) {
  return reader->Get(&chunk->id) && reader->Get(&chunk->version) &&
         reader->Get(&chunk->num_points) && reader->GetString(&chunk->points_blob) &&
         chunk->num_points <= ShapeChunk::kMaxPoints;
}

bool GetDensePhoto(ByteReader* reader, DenseManifest::Photo* photo) {
  return reader->Get(&photo->image_id) && reader->Get(&photo->scale) &&
         reader->Get(&photo->share) &&
         GetVector(reader, kMinDenseChunkBytes, &photo->chunks, GetDenseChunk) &&
         std::isfinite(photo->scale) && photo->scale > 0 && std::isfinite(photo->share);
}

bool GetMeshChunkEntry(ByteReader* reader, DenseManifest::Mesh::Chunk* chunk) {
  return reader->Get(&chunk->id) && reader->Get(&chunk->version) &&
         reader->Get(&chunk->num_vertices) && reader->Get(&chunk->num_triangles) &&
         reader->GetString(&chunk->blob) && chunk->num_vertices <= MeshChunk::kMaxVertices &&
         chunk->num_triangles <= MeshChunk::kMaxTriangles;
}

template <size_t N>
bool AreFinite(const std::array<double, N>& values) {
  return std::all_of(values.begin(), values.end(), [](double v) { return std::isfinite(v); });
}

bool GetFramePhoto(ByteReader* reader, DenseManifest::Mesh::FramePhoto* photo) {
  return reader->Get(&photo->image_id) && GetArray(reader, &photo->qvec) &&
         GetArray(reader, &photo->tvec) && AreFinite(photo->qvec) && AreFinite(photo->tvec);
}

void PutMesh(const DenseManifest::Mesh& mesh, ByteWriter* writer) {
  writer->Put(mesh.voxel);
  writer->Put(static_cast<uint32_t>(mesh.frame.size()));
  for (const DenseManifest::Mesh::FramePhoto& photo : mesh.frame) {
    writer->Put(photo.image_id);
    PutArray(writer, photo.qvec);
    PutArray(writer, photo.tvec);
  }
  writer->Put(static_cast<uint32_t>(mesh.chunks.size()));
  for (const DenseManifest::Mesh::Chunk& chunk : mesh.chunks) {
    for (const uint64_t value : {chunk.id, chunk.version}) writer->Put(value);
    for (const uint32_t value : {chunk.num_vertices, chunk.num_triangles}) writer->Put(value);
    writer->PutString(chunk.blob);
  }
}

bool GetMesh(ByteReader* reader, DenseManifest::Mesh* mesh) {
  return reader->Get(&mesh->voxel) && std::isfinite(mesh->voxel) && mesh->voxel >= 0 &&
         GetVector(reader, kFramePhotoBytes, &mesh->frame, GetFramePhoto) &&
         GetVector(reader, kMinMeshChunkBytes, &mesh->chunks, GetMeshChunkEntry);
}

}  // namespace

int64_t DenseManifest::NumTriangles() const {
  int64_t sum = 0;
  for (const Mesh::Chunk& chunk : mesh.chunks) sum += chunk.num_triangles;
  return sum;
}

int64_t DenseManifest::NumPoints() const {
  int64_t sum = 0;
  for (const Photo& photo : photos) {
    for (const Chunk& chunk : photo.chunks) sum += chunk.num_points;
  }
  return sum;
}

Bytes EncodeDenseManifest(const DenseManifest& manifest) {
  ByteWriter writer = Begin(kDenseManifest);
  writer.Put(manifest.version);
  writer.Put(static_cast<uint32_t>(manifest.photos.size()));
  for (const DenseManifest::Photo& photo : manifest.photos) {
    writer.Put(photo.image_id);
    writer.Put(photo.scale);
    writer.Put(photo.share);
    writer.Put(static_cast<uint32_t>(photo.chunks.size()));
    for (const DenseManifest::Chunk& chunk : photo.chunks) {
      writer.Put(chunk.id);
      writer.Put(chunk.version);
      writer.Put(chunk.num_points);
      writer.PutString(chunk.points_blob);
    }
  }
  PutMesh(manifest.mesh, &writer);
  return writer.Take();
}

Result<DenseManifest> DecodeDenseManifest(const Bytes& bytes) {
  return DecodeAll<DenseManifest>(
      bytes, kDenseManifest, [](ByteReader* in, DenseManifest* manifest) {
        return in->Get(&manifest->version) &&
               GetVector(in, kMinDensePhotoBytes, &manifest->photos, GetDensePhoto) &&
               GetMesh(in, &manifest->mesh);
      });
}

}  // namespace skein
