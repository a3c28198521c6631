// Reprojection of common points under a similarity, and the non-linear refinement of it.
#pragma once

#include <vector>

#include "geometry/sim3_ransac.h"

namespace skein {

// How one photo agrees with a similarity.
struct ImageScore {
  int num_points = 0;         // tested
  int num_inliers = 0;        // reproject within the limit in both directions
  double sum_error_px = 0.0;  // over inliers, mean of both directions
};

// Limit for one photo, of its camera in the target, see kMaxSim3ErrorPx.
double MaxErrorPx(const Camera& target_camera);

// The larger of both directions' reprojection errors, infinity for a point behind a camera.
// `source_from_target` is the inverse of `target_from_source`.
double SymmetricErrorPx(const SharedPhoto& image, const SharedPhoto::CommonPoint& point,
                        const Similarity& target_from_source, const Similarity& source_from_target,
                        double* mean_px);

// Scores at most `max_points` points, evenly spread over the list; all if it is 0.
ImageScore ScoreImage(const SharedPhoto& image, const Similarity& target_from_source,
                      int max_points);

// Minimises the symmetric reprojection error with a robust loss over the points that are inliers of
// `initial`, in the photos `used` (same length as `shared`). Returns `initial` when it diverges.
Similarity RefineSim3(const std::vector<SharedPhoto>& shared, const std::vector<bool>& used,
                      const Similarity& initial);

}  // namespace skein
