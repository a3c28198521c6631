// What two photos of a surfel are worth together, and one of them. Inside of libs/guidance.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "guidance/quality.h"

namespace skein {

// Beyond this ground sampling distance a photo adds nothing.
inline double MaxGsd(const QualityOptions& options) { return 4 * options.target_gsd; }

ViewOfSurfel ViewFrom(const Eigen::Vector3d& centre, double focal_px,
                      const Eigen::Vector3d& position);
std::vector<ViewOfSurfel> ViewsOf(const GuidedMap& map, const Surfel& surfel);

// J'J of a point for 1 px of noise.
Eigen::Matrix3d InformationOf(const ViewOfSurfel& view);
// sqrt(n' information^-1 n); infinite where it is singular.
double SigmaAlong(const Eigen::Vector3d& normal, const Eigen::Matrix3d& information);

}  // namespace skein
