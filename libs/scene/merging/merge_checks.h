// Residuals of a model before and after a merge, and the tolerance within which a merge may make
// them worse.
#pragma once

#include <set>
#include <utility>
#include <vector>

#include "core/result.h"
#include "sfm/reconstruction.h"

namespace skein {

// An observation: image and point2D index.
using Observation = std::pair<ImageId, Point2DIdx>;

// Every observation of a point by a registered photo, restricted to `images` unless that is empty.
std::vector<Observation> ObservationsOf(const Reconstruction& model,
                                        const std::set<ImageId>& images);

struct Residuals {
  int num_observations = 0;    // asked for
  int num_good = 0;            // present, before the camera, within the limit
  int num_behind = 0;          // the point is behind the camera
  double mean_error_px = 0.0;  // over the good ones

  double GoodShare() const {
    return num_observations > 0 ? static_cast<double>(num_good) / num_observations : 1.0;
  }
};

// `observations` in `model`; one that has no point there any more is asked for and not good.
Residuals MeasureResiduals(const Reconstruction& model,
                           const std::vector<Observation>& observations, double max_error_px);

// An error if `after` is worse than `before` beyond the tolerance: what is worse.
Status CompareResiduals(const Residuals& before, const Residuals& after);

}  // namespace skein
