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
  double weight = 1;                                // its matches that agree
};

struct RotationAveraging {
  std::map<uint32_t, Eigen::Matrix3d> rotations;  // camera from world
  std::vector<bool> fits;                         // of each relative rotation
};

// A maximum spanning tree, then iteratively reweighted least squares on the tangent space
// (Chatterjee and Govindu, ICCV 2013): Geman-McClure of 5 degrees, in which a pair counts by its
// weight. False pairs of an object with equal sides may be more than the true ones, but have fewer
// matches. The descent starts from the tree, and again from L1, which corrects the tree's false
// pairs but may follow others; the lower cost stays. A relative rotation fits if it differs by at
// most `max_error_deg`. Only the largest connected component of the graph of fitting rotations is
// kept. Empty input gives an empty result.
RotationAveraging AverageRotations(const std::vector<RelativeRotation>& pairs,
                                   double max_error_deg);

}  // namespace skein
