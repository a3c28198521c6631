// Visually similar structures between two submaps, by missing correspondences (Zach et al. 2010,
// Heinly et al. 2014). Points of a submap are projected into the shared photos of the other. In the
// same place a photo observes, region by region, about as many of them as the submap's own photos
// do. In another place whole regions stay empty although they have features. The submap's own
// photos calibrate the check, so it needs no absolute threshold for the repeatability of features.
#pragma once

#include <set>
#include <string>

#include "base/reconstruction.h"

namespace skein {

struct TwinOptions {
  int num_columns = 8;  // regions of a photo
  int num_rows = 6;
  int min_points_per_region = 8;     // predicted points that make a region count
  int min_regions = 6;               // regions that make a photo count
  int min_images = 3;                // such photos; fewer say nothing
  double max_view_angle_deg = 20.0;  // to a photo that observes the point
  double max_scale_ratio = 1.5;      // of the distances, likewise
  double empty_share = 0.25;  // of the usual share of observed points: below, a region is empty
  double max_empty_regions = 0.4;  // share of empty regions beyond the side's own usual one
  int max_reference_images = 20;   // of the side, for the usual shares
};

// How well a photo observes the points of one side that it should see.
struct RegionStatistics {
  int num_regions = 0;
  int num_empty = 0;
  int num_predicted = 0;
  int num_observed = 0;
};

// Empty if the shared photos see what each side predicts, else which side is missing in them.
// `target`, `source`: before the merge, each in its own frame; `shared` is registered in both.
std::string FindTwins(const colmap::Reconstruction& target, const colmap::Reconstruction& source,
                      const std::set<colmap::image_t>& shared, const TwinOptions& options);

}  // namespace skein
