// The neighbours of a photo, and the range of its depths, from the sparse map.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "depth/depth_map.h"

namespace skein {

constexpr size_t kNumMatched = 3;     // neighbours that a photo is matched with
constexpr size_t kNumConfirming = 6;  // neighbours whose maps may agree with one

struct SparsePhoto {
  DepthPose cam_from_world;
  std::vector<int> points;  // indices of the points that it observes, ascending, each once
};

// The photos to match photo `index` with, best first, at most `most`. A common point counts 1 where
// the rays meet at 5 to 25 degrees, less down to 0 at 1 and at 45 degrees. A photo with a sum below
// kMinCommon is no neighbour; so are all after a pure rotation. The best is chosen first. Each
// chosen photo then halves what its points count for the next, times their weight: neighbours
// together cover the photo. A photo that stands where a chosen one stands, seen from the points,
// counts half.
constexpr double kMinCommon = 10;
std::vector<int> ChooseNeighbours(const std::vector<SparsePhoto>& photos,
                                  const std::vector<Eigen::Vector3d>& points, int index,
                                  size_t most);

// Depths of the points that a photo observes, of those in front of it.
std::vector<double> DepthsOfPoints(const SparsePhoto& photo,
                                   const std::vector<Eigen::Vector3d>& points);

// The depths of a photo's points, with a margin of inverse depth on both sides, without the nearest
// and the farthest percent, and the planes that many of them lie on. nullopt: too few points in
// front of the camera.
std::optional<DepthRange> RangeOfPoints(const SparsePhoto& photo,
                                        const std::vector<Eigen::Vector3d>& points);

}  // namespace skein
