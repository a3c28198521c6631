// Figures of a georeference, as a fact tells them and report.json shows them.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "geometry/georeference.h"

namespace skein {

// A photo whose position does not agree with the model.
struct GeoOutlier {
  std::string name;
  double residual_m = 0;
};

// Residuals are those of the inliers. Without altitudes_used rmse, median and maximum are
// horizontal.
struct GeoreferenceSummary {
  bool ok = false;
  std::string reason;        // why not, for a person
  size_t num_positions = 0;  // photos with a plausible position
  size_t num_altitudes = 0;  // of these, with an altitude
  // The following are set if ok.
  GeodeticPosition origin;
  Similarity enu_from_model;
  size_t num_inliers = 0;
  bool altitudes_used = true;
  double rotation_sigma_deg = 0, scale_sigma = 0;
  double rmse_m = 0, median_m = 0, max_m = 0;
  double horizontal_rmse_m = 0;
  std::optional<double> vertical_rmse_m;  // nullopt: no inlier has an altitude
  std::vector<GeoOutlier> outliers;       // in the order of the photos
};

GeoreferenceSummary Summarise(const Georeference& georeference);

}  // namespace skein
