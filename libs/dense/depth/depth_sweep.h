// The depth map of a photo, by a plane sweep through its neighbours (Collins 1996) and semi-global
// matching (Hirschmueller 2008).
//
// Parallel planes, z = const of the reference camera or those of a region (SweepPlanes), are evenly
// spaced in 1 / z. Each neighbour is warped once by the homography of the middle plane. A plane
// then moves and scales the warped neighbour alone, so any motion of the camera costs as much as a
// rectified pair. A pixel's cost of a plane is the Hamming distance of census transforms, summed
// over the neighbours, each limited to the best one's plus a constant: a neighbour in which the
// surface is hidden counts little.
//
// Planes of one slope (SweepPlanes), a family, miss what is much steeper, as ground at a grazing
// angle. A sweep may have several families, beside each other in the costs: paths change the family
// as they change to a far depth.
//
// A family has kMaxFamilySteps planes at most. A range whose planes would be more than a pixel
// apart is searched from coarse to fine: the map of the photos at half their size gives regions
// (depth_regions.h), each with a sweep of its own.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "core/result.h"
#include "depth/depth_map.h"
#include "depth/sweep_kernels.h"

namespace skein {

// Steps between near and far: as many as planes are one pixel apart in a neighbour, at least
// kMinSweepSteps and at most kMaxFamilySteps, rounded up to a multiple of kSweepLanes.
constexpr int kMinSweepSteps = 64;

// CPU seconds of the last map's parts.
struct DepthTimes {
  double warp = 0, costs = 0, paths = 0, choice = 0;
  double Sum() const { return warp + costs + paths + choice; }
};

// Bytes that a map of this size and number of steps takes while it is made: three a pixel and step,
// and the neighbours.
int64_t DepthSweepBytes(int width, int height, int steps, int neighbours);

// Keeps its working memory (DepthSweepBytes), so keep one a thread.
class DepthSweep {
 public:
  // Throws std::invalid_argument if the processor does not run the kernel.
  explicit DepthSweep(InstructionSet kernel = FastestInstructionSet());
  ~DepthSweep();
  DepthSweep(DepthSweep&& other) noexcept;

  // Depths that no neighbour contradicts; consistency.h finds those that are also confirmed.
  // Neighbours beyond kMaxSweepViews are left out. Without any, or where none has parallax, all
  // pixels are holes. nullopt: stopped. Throws std::invalid_argument unless 0 < range.near <
  // range.far, all numbers are finite and a photo's pixels have its camera's size.
  std::optional<DepthMap> Estimate(const DepthPhoto& photo,
                                   const std::vector<const DepthPhoto*>& neighbours,
                                   const DepthRange& range, const DepthStop& stop = {});

  const DepthTimes& times() const;  // of the last map
  int steps() const;                // of the last map's last sweep

 private:
  class Workspace;
  std::unique_ptr<Workspace> workspace_;
};

}  // namespace skein
