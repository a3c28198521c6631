#pragma once

#include <functional>
#include <utility>
#include <vector>

#include "core/result.h"
#include "map/scene_map.h"

namespace skein {

struct RetriangulationOptions {
  double min_ratio = 0.2;            // pairs with a smaller part of triangulated matches are tried
  double max_angle_error_deg = 5.0;  // to continue a track
  colmap::IncrementalTriangulator::Options triangulation;

  Status Check() const;
};

Status CheckTriangulation(const colmap::IncrementalTriangulator::Options& options);

// Continues tracks and triangulates over the matches of under-reconstructed pairs, which drift has
// kept apart (COLMAP's Retriangulate, whose counters need its database). Returns the number of
// added observations. Throws std::invalid_argument on nonsensical options.
int Retriangulate(const RetriangulationOptions& options,
                  const std::vector<std::pair<ImageId, ImageId>>& pairs, SceneMap* map);

// Drops all points and triangulates the matches of the registered photos as they stand, photo by
// photo by name, as COLMAP's point_triangulator does. Tracks that grew with the map depend on the
// poses they were found with. Visits all matches; poses and cameras stay. Where there is a `stop`,
// it is asked before each photo; at true the former points are back, and the result is false.
bool TriangulateAnew(const colmap::IncrementalTriangulator::Options& options, SceneMap* map,
                     const std::function<bool()>& stop = nullptr);

}  // namespace skein
