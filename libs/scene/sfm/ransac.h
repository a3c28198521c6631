#pragma once

namespace skein {

// Limits of a RANSAC or LO-RANSAC search, as COLMAP's.
struct RansacLimits {
  double max_error = 0;           // of an inlier, in the unit of the points
  double min_inlier_ratio = 0.1;  // assumed, for the number of trials
  double confidence = 0.99;       // that a sample without outlier is drawn
  int min_num_trials = 0;
  int max_num_trials = 1'000'000'000;
};

}  // namespace skein
