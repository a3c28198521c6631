#include "formats/dense.h"

#include <cmath>

#include "formats/encoding.h"
#include "formats/shape.h"

namespace skein {
namespace {

using namespace encoding;

constexpr char kDenseManifest[] = "SKDM";
constexpr size_t kMinDensePhotoBytes = 4 + 8 + 4 + 4, kMinDenseChunkBytes = 8 + 8 + 4 + 4;

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

}  // namespace

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
  return writer.Take();
}

Result<DenseManifest> DecodeDenseManifest(const Bytes& bytes) {
  return DecodeAll<DenseManifest>(
      bytes, kDenseManifest, [](ByteReader* in, DenseManifest* manifest) {
        return in->Get(&manifest->version) &&
               GetVector(in, kMinDensePhotoBytes, &manifest->photos, GetDensePhoto);
      });
}

}  // namespace skein
