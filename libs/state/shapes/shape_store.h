// The newest map snapshot (shape) of each submap.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "core/bytes.h"
#include "formats/shape.h"

namespace skein {

// The shape of a submap.
struct Shape {
  struct Chunk {
    uint64_t id = 0;
    uint64_t version = 0;
    uint32_t num_points = 0;
    std::shared_ptr<const Bytes> points;
    std::shared_ptr<const Bytes> tracks;  // null: they are the blob's of that name
    std::string tracks_blob;
    uint64_t tracks_bytes = 0;
  };

  int64_t submap_id = 0;
  uint64_t version = 0;
  std::string owner;       // instance that serves the tracks; "" where they are here
  std::string model_blob;  // that it was made of; "": a mapper told it
  std::vector<ShapePhoto> photos;
  std::vector<ShapeCamera> cameras;
  std::vector<Chunk> chunks;

  const Chunk* Find(uint64_t chunk_id) const;
};
using ShapePtr = std::shared_ptr<const Shape>;

// Whether a photo's pose is finite, and its quaternion long enough to be normalised.
bool HasPose(const ShapePhoto& photo);

// The newest shape of each submap. Any thread.
class ShapeStore {
 public:
  // Chunks beyond this together are refused.
  static constexpr int64_t kMaxBytes = int64_t{1} << 30;

  // False, and nothing has changed, if the submap's stored shape is newer, or there is no room.
  bool Set(ShapePtr shape);
  void Drop(int64_t submap_id);
  // Null if there is none.
  ShapePtr Find(int64_t submap_id) const;

 private:
  mutable std::mutex mutex_;
  std::map<int64_t, ShapePtr> shapes_;
};

}  // namespace skein
