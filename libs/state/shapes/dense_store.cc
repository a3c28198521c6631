#include "shapes/dense_store.h"

#include <utility>

namespace skein {

const DenseManifest::Chunk* DensePoints::Find(uint64_t chunk_id) const {
  for (const DenseManifest::Photo& photo : manifest.photos) {
    for (const DenseManifest::Chunk& chunk : photo.chunks) {
      if (chunk.id == chunk_id) return &chunk;
    }
  }
  return nullptr;
}

const DenseManifest::Mesh::Chunk* DensePoints::FindMeshChunk(uint64_t chunk_id) const {
  for (const DenseManifest::Mesh::Chunk& chunk : manifest.mesh.chunks) {
    if (chunk.id == chunk_id) return &chunk;
  }
  return nullptr;
}

void DenseStore::Set(int64_t submap_id, DensePointsPtr points) {
  const std::lock_guard<std::mutex> lock(mutex_);
  points_[submap_id] = std::move(points);
}

bool DenseStore::Drop(int64_t submap_id) {
  const std::lock_guard<std::mutex> lock(mutex_);
  return points_.erase(submap_id) > 0;
}

DensePointsPtr DenseStore::Find(int64_t submap_id) const {
  const std::lock_guard<std::mutex> lock(mutex_);
  const auto points = points_.find(submap_id);
  return points == points_.end() ? nullptr : points->second;
}

}  // namespace skein
