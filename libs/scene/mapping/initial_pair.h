#pragma once

#include "core/limits.h"
#include "core/result.h"
#include "map/scene_map.h"

namespace skein {

struct InitialPairOptions {
  int min_num_inliers = limits::kMinSeedInliers;
  double min_triangulation_angle_deg =
      limits::kInitialAnglesDeg[0];  // median; the caller relaxes it stepwise

  Status Check() const;
};

// For a pair that was chosen by what its verified matches say. Half of both figures is asked for,
// as the relative pose is estimated again.
InitialPairOptions OptionsOfSeed(int num_inliers, double triangulation_angle_rad);

struct InitialPairResult {
  Status status;
  int num_inliers = 0;
  int num_points = 0;
  double triangulation_angle_deg = 0;
};

// Relative pose of two photos (5-point LO-RANSAC on their verified matches), and their points.
// A camera without focal length from EXIF is tried at several focal lengths; the one with most
// inliers wins. On success both are registered, the first at the origin, the baseline of unit
// length. Else the map is as it was.
InitialPairResult RegisterInitialPair(const InitialPairOptions& options, ImageId image_id1,
                                      ImageId image_id2, SceneMap* map);

}  // namespace skein
