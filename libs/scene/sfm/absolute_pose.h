#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "sfm/camera.h"
#include "sfm/ransac.h"

namespace skein {

struct AbsolutePose {
  Eigen::Matrix3d R = Eigen::Matrix3d::Identity();  // cam_from_world
  Eigen::Vector3d t = Eigen::Vector3d::Zero();
};

// The pose from which most points are seen at their pixels, by COLMAP's LO-RANSAC (P3P; EPnP of the
// inliers). Errors in pixels. As many points as pixels. nullopt if none is found. Uses the thread's
// random numbers.
std::optional<AbsolutePose> EstimateAbsolutePose(const RansacLimits& limits,
                                                 const std::vector<Eigen::Vector2d>& pixels,
                                                 const std::vector<Eigen::Vector3d>& points,
                                                 const Camera& camera);

}  // namespace skein
