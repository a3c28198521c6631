// The newest dense points and mesh of each submap, as their manifest names them.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <string>

#include "formats/dense.h"

namespace skein {

struct DensePoints {
  std::string owner;  // instance that serves the chunks
  std::string manifest_blob;
  uint64_t version = 0;  // as this process counts: above that of what was there before
  DenseManifest manifest;

  // Null: there is none, or none any more.
  const DenseManifest::Chunk* Find(uint64_t chunk_id) const;
  const DenseManifest::Mesh::Chunk* FindMeshChunk(uint64_t chunk_id) const;
};
using DensePointsPtr = std::shared_ptr<const DensePoints>;

// Any thread.
class DenseStore {
 public:
  void Set(int64_t submap_id, DensePointsPtr points);
  // False: there were none.
  bool Drop(int64_t submap_id);
  // Null if there are none.
  DensePointsPtr Find(int64_t submap_id) const;

 private:
  mutable std::mutex mutex_;
  std::map<int64_t, DensePointsPtr> points_;
};

}  // namespace skein
