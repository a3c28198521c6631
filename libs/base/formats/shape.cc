#include "formats/shape.h"

#include <stdexcept>

#include "formats/encoding.h"

namespace skein {
namespace {

using namespace encoding;

constexpr char kChunk[] = "SKC1";
constexpr char kTracks[] = "SKPT";
constexpr char kManifest[] = "SKSM";

constexpr size_t kPhotoBytes = 2 * 4 + 7 * 8, kMinCameraBytes = 4 + 2 * 8 + 4 * 8 + 4 + 4;
constexpr size_t kMinChunkBytes = 8 + 8 + 4 + 4 + 4 + 8;

void PutPoint(ByteWriter* writer, const ShapePoint& point) {
  PutArray(writer, point.xyz);
  PutArray(writer, point.rgb);
  writer->Put(point.num_photos);
}

bool GetPoint(ByteReader* reader, ShapePoint* point) {
  return GetArray(reader, &point->xyz) && GetArray(reader, &point->rgb) &&
         reader->Get(&point->num_photos);
}

bool GetPhoto(ByteReader* reader, ShapePhoto* photo) {
  return reader->Get(&photo->image_id) && reader->Get(&photo->camera_id) &&
         GetArray(reader, &photo->qvec) && GetArray(reader, &photo->tvec);
}

bool GetCamera(ByteReader* reader, ShapeCamera* camera) {
  return reader->Get(&camera->camera_id) && reader->Get(&camera->width) &&
         reader->Get(&camera->height) && reader->Get(&camera->fx) && reader->Get(&camera->fy) &&
         reader->Get(&camera->cx) && reader->Get(&camera->cy) && reader->Get(&camera->model_id) &&
         GetVector(reader, sizeof(double), &camera->params,
                   [](ByteReader* in, double* value) { return in->Get(value); });
}

bool GetChunk(ByteReader* reader, ShapeManifest::Chunk* chunk) {
  return reader->Get(&chunk->id) && reader->Get(&chunk->version) &&
         reader->Get(&chunk->num_points) && reader->GetString(&chunk->points_blob) &&
         reader->GetString(&chunk->tracks_blob) && reader->Get(&chunk->tracks_bytes);
}

}  // namespace

Bytes EncodeShapeChunk(const ShapeChunk& chunk) {
  if (chunk.points.size() > ShapeChunk::kMaxPoints) throw std::invalid_argument("chunk too large");
  ByteWriter writer;
  writer.PutRaw(kChunk, 4);
  writer.Put(static_cast<uint32_t>(chunk.points.size()));
  PutArray(&writer, chunk.origin);
  writer.Put(chunk.step);
  writer.Put(chunk.version);
  for (const ShapePoint& point : chunk.points) PutPoint(&writer, point);
  return writer.Take();
}

Result<ShapeChunk> DecodeShapeChunk(const Bytes& bytes) {
  ByteReader reader(bytes);
  char identifier[4];
  uint32_t count = 0;
  ShapeChunk chunk;
  if (!reader.GetRaw(identifier, 4) || std::string(identifier, 4) != kChunk) {
    return DataLoss(std::string(kChunk) + ": not of this format");
  }
  if (!reader.Get(&count) || !GetArray(&reader, &chunk.origin) || !reader.Get(&chunk.step) ||
      !reader.Get(&chunk.version) || count > ShapeChunk::kMaxPoints ||
      reader.remaining() != count * kShapePointBytes) {
    return DataLoss(std::string(kChunk) + ": not the bytes of its points");
  }
  chunk.points.resize(count);
  for (ShapePoint& point : chunk.points) GetPoint(&reader, &point);
  return chunk;
}

Bytes EncodePointTracks(const PointTracks& tracks) {
  ByteWriter writer = Begin(kTracks);
  writer.Put(static_cast<uint32_t>(tracks.ends.size()));
  for (const uint32_t end : tracks.ends) writer.Put(end);
  writer.Put(static_cast<uint32_t>(tracks.observations.size()));
  for (const PointObservation& observation : tracks.observations) {
    writer.Put(observation.image_id);
    writer.Put(observation.point2D_idx);
  }
  return writer.Take();
}

Result<PointTracks> DecodePointTracks(const Bytes& bytes) {
  return DecodeAll<PointTracks>(bytes, kTracks, [](ByteReader* in, PointTracks* tracks) {
    uint32_t last = 0;
    return GetVector(in, 4, &tracks->ends,
                     [&last](ByteReader* reader, uint32_t* end) {
                       if (!reader->Get(end) || *end < last) return false;
                       last = *end;
                       return true;
                     }) &&
           GetVector(in, 8, &tracks->observations,
                     [](ByteReader* reader, PointObservation* observation) {
                       return reader->Get(&observation->image_id) &&
                              reader->Get(&observation->point2D_idx);
                     }) &&
           last == tracks->observations.size();
  });
}

Bytes EncodeShapeManifest(const ShapeManifest& manifest) {
  ByteWriter writer = Begin(kManifest);
  writer.Put(manifest.version);
  writer.Put(static_cast<uint32_t>(manifest.photos.size()));
  for (const ShapePhoto& photo : manifest.photos) {
    writer.Put(photo.image_id);
    writer.Put(photo.camera_id);
    PutArray(&writer, photo.qvec);
    PutArray(&writer, photo.tvec);
  }
  writer.Put(static_cast<uint32_t>(manifest.cameras.size()));
  for (const ShapeCamera& camera : manifest.cameras) {
    writer.Put(camera.camera_id);
    for (const uint64_t side : {camera.width, camera.height}) writer.Put(side);
    for (const double value : {camera.fx, camera.fy, camera.cx, camera.cy}) writer.Put(value);
    writer.Put(camera.model_id);
    writer.Put(static_cast<uint32_t>(camera.params.size()));
    for (const double value : camera.params) writer.Put(value);
  }
  writer.Put(static_cast<uint32_t>(manifest.chunks.size()));
  for (const ShapeManifest::Chunk& chunk : manifest.chunks) {
    writer.Put(chunk.id);
    writer.Put(chunk.version);
    writer.Put(chunk.num_points);
    writer.PutString(chunk.points_blob);
    writer.PutString(chunk.tracks_blob);
    writer.Put(chunk.tracks_bytes);
  }
  return writer.Take();
}

Result<ShapeManifest> DecodeShapeManifest(const Bytes& bytes) {
  return DecodeAll<ShapeManifest>(bytes, kManifest, [](ByteReader* in, ShapeManifest* manifest) {
    return in->Get(&manifest->version) && GetVector(in, kPhotoBytes, &manifest->photos, GetPhoto) &&
           GetVector(in, kMinCameraBytes, &manifest->cameras, GetCamera) &&
           GetVector(in, kMinChunkBytes, &manifest->chunks, GetChunk);
  });
}

}  // namespace skein
