// How far the depths of maps are to be trusted, in figures.
#pragma once

#include <cstdint>
#include <vector>

#include "depth/depth_map.h"

namespace skein {

// Depths of sweeps, each counted once.
struct DepthCounts {
  int64_t agreed = 0;        // these stay (consistency.h)
  int64_t contradicted = 0;  // 0 in StaticMask (consistency.h)
  int64_t alone = 0;         // the rest

  int64_t Sum() const { return agreed + contradicted + alone; }
};

// kept: the depths of `sweep` that stay. mask: StaticMask of `sweep`.
DepthCounts CountDepths(const DepthMap& sweep, const DepthMap& kept, const cv::Mat1b& mask);

DepthCounts SumOf(const std::vector<DepthCounts>& counts);

// Percentiles of a predicted standard error, in the unit of the maps.
struct ErrorPercentiles {
  double p50 = 0, p95 = 0;
};

// Percentiles over all depths of all maps, each within 1 / 512 of its value. 0 without depths.
ErrorPercentiles PercentilesOfErrors(const std::vector<DepthMap>& maps);

}  // namespace skein
