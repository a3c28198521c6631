#include "shapes/shape_store.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace skein {

bool HasPose(const ShapePhoto& photo) {
  constexpr double kLeastNorm = 1e-6;
  double squares = 0;
  for (const double value : photo.qvec) squares += value * value;
  const double norm = std::sqrt(squares);
  return std::isfinite(norm) && norm >= kLeastNorm &&
         std::all_of(photo.tvec.begin(), photo.tvec.end(),
                     [](double value) { return std::isfinite(value); });
}
namespace {

int64_t BytesOf(const Shape& shape) {
  int64_t bytes = 0;
  for (const Shape::Chunk& chunk : shape.chunks) {
    bytes += static_cast<int64_t>(chunk.points->size());
    if (chunk.tracks != nullptr) bytes += static_cast<int64_t>(chunk.tracks->size());
  }
  return bytes;
}

}  // namespace

const Shape::Chunk* Shape::Find(uint64_t chunk_id) const {
  for (const Chunk& chunk : chunks) {
    if (chunk.id == chunk_id) return &chunk;
  }
  return nullptr;
}

bool ShapeStore::Set(ShapePtr shape) {
  const std::lock_guard<std::mutex> lock(mutex_);
  const auto known = shapes_.find(shape->submap_id);
  if (known != shapes_.end() && known->second->version > shape->version) return false;
  int64_t bytes = BytesOf(*shape);
  for (const auto& [id, other] : shapes_) {
    if (id != shape->submap_id) bytes += BytesOf(*other);
  }
  if (bytes > kMaxBytes) return false;
  shapes_[shape->submap_id] = std::move(shape);
  return true;
}

void ShapeStore::Drop(int64_t submap_id) {
  const std::lock_guard<std::mutex> lock(mutex_);
  shapes_.erase(submap_id);
}

ShapePtr ShapeStore::Find(int64_t submap_id) const {
  const std::lock_guard<std::mutex> lock(mutex_);
  const auto found = shapes_.find(submap_id);
  return found == shapes_.end() ? nullptr : found->second;
}

}  // namespace skein
