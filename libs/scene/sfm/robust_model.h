#pragma once

// Searches for the E, F or H of matched points by LO-RANSAC.

#include <Eigen/Core>
#include <vector>

#include "sfm/ransac.h"

namespace skein {

// Result of a search.
struct RobustModel {
  bool found = false;
  double num_inliers = 0;
  double cost = 0;  // of a refined model: truncated sum of squared errors
  Eigen::Matrix3d matrix = Eigen::Matrix3d::Zero();
  std::vector<char> inlier_mask;
};

// Matches from which a search of E draws its samples; those of F and H draw from the surest.
enum class Sampling {
  kUniform,      // all: COLMAP's search, to the bit
  kSurestFirst,  // the first, surest ones, and more with each draw (PROSAC; Chum and Matas 2005)
};

using Points2 = std::vector<Eigen::Vector2d>;

// `points1[i]` matches `points2[i]`. Points of E lie on the plane at depth 1; those of F and H are
// pixels. Errors are Sampson's for E and F, and distances in the second image for H. All use the
// thread's random numbers.
RobustModel SearchEssential(const RansacLimits& limits, Sampling sampling, const Points2& points1,
                            const Points2& points2);
RobustModel SearchFundamental(const RansacLimits& limits, const Points2& points1,
                              const Points2& points2);
RobustModel SearchHomography(const RansacLimits& limits, const Points2& points1,
                             const Points2& points2);

// Local optimisation as in LO-RANSAC: a fit to the inliers as long as it lowers the truncated sum
// of squared errors (MSAC; Torr and Zisserman 2000). Some hundred inliers, spread evenly over the
// list, determine a model as well as all.
RobustModel RefineFundamental(const Eigen::Matrix3d& start, const Points2& points1,
                              const Points2& points2, double max_error_px);
RobustModel RefineHomography(const Eigen::Matrix3d& start, const Points2& points1,
                             const Points2& points2, double max_error_px);

}  // namespace skein
