// Look-alikes: two places that share a façade fit together perfectly where they look alike. What
// tells them apart is what a photo does *not* see. Points of a submap project into the shared
// photos it holds; where the place is the same, a photo observes about as many of them, region
// by region, as that side's own photos do. Where only a part looks alike, whole regions stay
// empty although features are there. (The idea of missing correspondences: Zach et al. 2010,
// Heinly et al. 2014; calibrated here on the submap itself, so it needs no absolute threshold for
// the repeatability of features.)
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
