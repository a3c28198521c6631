#pragma once

#include <utility>
#include <vector>

#include "core/result.h"
#include "map/scene_map.h"

namespace skein {

struct RetriangulationOptions {
  double min_ratio = 0.2;            // pairs with a smaller part of triangulated matches are tried
  double max_angle_error_deg = 5.0;  // to continue a track
  TriangulationOptions triangulation;

  Status Check() const;
};

// Continues tracks and triangulates over the matches of under-reconstructed pairs, which drift has
// kept apart (COLMAP's Retriangulate, whose counters need its database). Returns the number of
// added observations. Throws std::invalid_argument on nonsensical options.
int Retriangulate(const RetriangulationOptions& options,
                  const std::vector<std::pair<ImageId, ImageId>>& pairs, SceneMap* map);

}  // namespace skein
