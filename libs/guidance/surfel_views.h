// The photos of a surfel as it sees them.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "guidance/quality.h"

namespace skein {

ViewOfSurfel ViewFrom(const Eigen::Vector3d& centre, double focal_px,
                      const Eigen::Vector3d& position);
std::vector<ViewOfSurfel> ViewsOf(const GuidedMap& map, const Surfel& surfel);

}  // namespace skein
