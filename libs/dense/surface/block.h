// Voxels of a sparse volume, in blocks.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <tuple>

namespace skein {

constexpr int kBlockSide = 8;
constexpr int kBlockVoxels = kBlockSide * kBlockSide * kBlockSide;

// A map's weight of a voxel, and steps of its distance in a voxel's side. Sums over 32,767 maps fit
// into 32 bits: kMostWeight * kDistanceSteps * kMostReach (map_band.h) < 2^16.
constexpr int kMostWeight = 255;
constexpr int kDistanceSteps = 32;

// Integer sums over depth maps: one that is taken out again leaves no trace.
struct Voxel {
  int32_t weight = 0;
  int32_t distance = 0;             // weight * distance; above 0 in front of the surface
  std::array<int32_t, 3> colour{};  // weight * (blue, green, red)

  // Mean distance in sides of a voxel. Requires weight > 0.
  float Distance() const {
    return static_cast<float>(distance) / static_cast<float>(weight) / kDistanceSteps;
  }
};

// x changes fastest, then y.
using Block = std::array<Voxel, kBlockVoxels>;

constexpr int VoxelOf(int x, int y, int z) { return x + kBlockSide * (y + kBlockSide * z); }

// Voxel (x, y, z) of a block has its sample at voxel side * (kBlockSide * index + (x, y, z)).
struct BlockIndex {
  int x = 0, y = 0, z = 0;

  BlockIndex Plus(int dx, int dy, int dz) const { return {x + dx, y + dy, z + dz}; }
  friend bool operator==(const BlockIndex& a, const BlockIndex& b) {
    return a.x == b.x && a.y == b.y && a.z == b.z;
  }
  friend bool operator<(const BlockIndex& a, const BlockIndex& b) {
    return std::tie(a.z, a.y, a.x) < std::tie(b.z, b.y, b.x);
  }
};

// Teschner et al. 2003, as in Niessner et al. 2013.
struct BlockHash {
  size_t operator()(const BlockIndex& i) const {
    return static_cast<size_t>(i.x) * 73856093U ^ static_cast<size_t>(i.y) * 19349669U ^
           static_cast<size_t>(i.z) * 83492791U;
  }
};

}  // namespace skein
