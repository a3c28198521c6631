// The space around the surface that a depth map shows, as a volume takes it in.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <unordered_set>
#include <vector>

#include "depth/depth_map.h"
#include "surface/block.h"

namespace skein {

// Largest distance from the surface at which a map tells something, in voxels: three predicted
// errors, within these limits.
constexpr float kLeastReach = 4, kMostReach = 8;

struct BandSample {
  int x = 0, y = 0;  // pixel of the map
  int weight = 0;    // 1 to kMostWeight
  int distance = 0;  // from the surface, along its normal, in voxels / kDistanceSteps
};

// Weight of a pixel: kMostWeight * cos a * min(1, v / (2 e))^2. a: angle between ray and normal, e:
// predicted error, v: side of a voxel. Behind the surface the weight falls to 0, linearly from half
// the reach on, so that both sides of a wall disturb each other less. Left out: pixels without a
// normal, at more than 88 degrees, that cover more than 32 voxels' sides, or with a weight below
// 0.5.
class MapBand {
 public:
  // The map must outlive it.
  MapBand(const DepthMap& map, double voxel, int num_threads);

  // Blocks that the band touches, ascending.
  std::vector<BlockIndex> Blocks() const;

  // nullopt: the point, in the camera's frame, lies outside the band.
  std::optional<BandSample> At(const Eigen::Vector3f& in_camera) const;

 private:
  struct Pixel {
    float slope = 0;  // distance along the normal per depth
    float reach = 0;
    float weight = 0;  // 0: left out
  };
  using BlockSet = std::unordered_set<BlockIndex, BlockHash>;

  Pixel PixelOf(int x, int y) const;
  const Pixel& At(int x, int y) const { return pixels_[x + static_cast<size_t>(y) * width_]; }
  // Depth at a position, in pixels whose first centre is at (0, 0), on the surface of `depth`.
  float Interpolate(float u, float v, float depth, float tolerance) const;
  void AddBlocks(int x, int y, BlockSet* blocks) const;

  const DepthMap& map_;
  const double voxel_;
  const int num_threads_;
  const int width_, height_;
  const Eigen::Matrix3f calibration_;
  std::vector<Pixel> pixels_;
};

}  // namespace skein
