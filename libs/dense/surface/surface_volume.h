// The surface that depth maps show, as a truncated signed distance volume (Curless and Levoy 1996),
// sparse by hashed blocks of voxels (Niessner et al. 2013).
//
// A map tells something about the voxels around its own surface alone (map_band.h). The space that
// no map tells about is unknown, neither free nor solid. The volume depends on the maps in it, not
// on the order in which they came.
#pragma once

#include <cstdint>
#include <memory>
#include <unordered_map>
#include <vector>

#include "core/result.h"
#include "core/threads.h"
#include "depth/coloured_map.h"
#include "surface/block.h"
#include "surface/map_band.h"

namespace skein {

struct SurfaceOptions {
  double voxel = 0;                      // side of a voxel, in the unit of the maps
  int64_t max_bytes = int64_t{2} << 30;  // of the blocks
  int num_threads = NumHardwareThreads();
};

// For one thread at a time.
class SurfaceVolume {
 public:
  // Throws std::invalid_argument unless voxel > 0, finite, and num_threads > 0.
  explicit SurfaceVolume(const SurfaceOptions& options);

  // kResourceExhausted: the blocks would take more than max_bytes; the volume is as before. A new
  // volume with larger voxels has room.
  Status Add(const ColouredMap& map);
  // Takes a map out again, exactly: the volume is as if the map had never come. Requires that the
  // map is in the volume, with this pose and these colours.
  void Remove(const ColouredMap& map);

  double voxel() const { return options_.voxel; }
  int num_threads() const { return options_.num_threads; }
  int64_t Bytes() const { return num_blocks_ * static_cast<int64_t>(sizeof(Block)); }

  // Grows by 1 with each map that comes or goes.
  uint64_t version() const { return version_; }
  // Blocks that changed after `version`, ascending, those that are empty now included.
  std::vector<BlockIndex> ChangedSince(uint64_t version) const;

  // Blocks that hold something, ascending.
  std::vector<BlockIndex> Blocks() const;
  // nullptr: no map tells about the block.
  const Block* Find(const BlockIndex& index) const;

 private:
  struct Entry {
    std::unique_ptr<Block> block;  // nullptr: empty
    uint64_t changed = 0;          // version
  };

  void Apply(const ColouredMap& map, const MapBand& band, const std::vector<BlockIndex>& indices,
             int sign);
  bool DropIfEmpty(Entry* entry);  // whether it was empty

  const SurfaceOptions options_;
  std::unordered_map<BlockIndex, Entry, BlockHash> entries_;
  int64_t num_blocks_ = 0;
  uint64_t version_ = 0;
};

}  // namespace skein
