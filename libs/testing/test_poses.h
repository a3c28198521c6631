// Poses for tests. World: z up.
#pragma once

#include <Eigen/Geometry>

#include "geometry/sim3_similarity.h"

namespace skein {

// Level.
inline CameraPose LookingAt(const Eigen::Vector3d& centre, const Eigen::Vector3d& target) {
  const Eigen::Vector3d z = (target - centre).normalized();
  const Eigen::Vector3d x = z.cross(Eigen::Vector3d::UnitZ()).normalized();
  Eigen::Matrix3d rotation;
  rotation << x.transpose(), z.cross(x).transpose(), z.transpose();
  CameraPose pose;
  pose.rotation = Eigen::Quaterniond(rotation);
  pose.translation = -(pose.rotation * centre);
  return pose;
}

}  // namespace skein
