// Absolute rotations from relative ones (rotation averaging).
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <map>
#include <vector>

namespace skein {

struct RelativeRotation {
  uint32_t id1 = 0, id2 = 0;
  Eigen::Matrix3d R = Eigen::Matrix3d::Identity();  // camera 2 from camera 1
  double weight = 1;                                // of the spanning tree: larger is surer
};

struct RotationAveraging {
  std::map<uint32_t, Eigen::Matrix3d> rotations;  // camera from world
  std::vector<bool> fits;                         // of each relative rotation
};

// A maximum spanning tree, then iteratively reweighted least squares on the tangent space: first
// L1, then Geman-McClure of 5 degrees (Chatterjee and Govindu, ICCV 2013). A relative rotation fits
// if it differs by at most `max_error_deg`. Only the largest connected component of the graph of
// fitting rotations is kept. Empty input gives an empty result.
RotationAveraging AverageRotations(const std::vector<RelativeRotation>& pairs,
                                   double max_error_deg);

}  // namespace skein
