#pragma once

#include <utility>
#include <vector>

#include "mapper/scene_map.h"

namespace skein {

struct RetriangulationOptions {
  double min_ratio = 0.2;            // pairs with a smaller part of triangulated matches are tried
  double max_angle_error_deg = 5.0;  // to continue a track
  colmap::IncrementalTriangulator::Options triangulation;
};

// Continues tracks over, and triangulates, the matches of under-reconstructed pairs, which
// drift has kept apart (COLMAP's Retriangulate, whose counters need its database). Returns the
// number of observations added.
int Retriangulate(const RetriangulationOptions& options,
                  const std::vector<std::pair<ImageId, ImageId>>& pairs, SceneMap* map);

}  // namespace skein
