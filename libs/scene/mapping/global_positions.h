// Positions of photos whose rotations are known, from the directions to common points.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <vector>

namespace skein {

// A point as it is seen.
struct PointRays {
  struct Ray {
    uint32_t image_id = 0;
    Eigen::Vector3d direction = Eigen::Vector3d::UnitZ();  // in the world's frame, unit length
  };
  std::vector<Ray> rays;
};

// Centres of the photos, up to scale and shift, in two steps:
//   sum huber(|d_ik v_ik - (X_k - c_i)|), d_ik >= 1
// (least unsquared deviations; Ozyesil and Singer, Robust Camera Location Estimation by Convex
// Programming, CVPR 2015) is convex, so it has one minimum from any start;
//   sum cauchy(|v_ik - s_ik (X_k - c_i)|), s_ik > 0
// (global positioning; Pan et al., Global Structure-from-Motion Revisited, ECCV 2024, section 3.2)
// goes on from there: it judges far points as near ones, and false rays hardly move it. The second
// sum alone has wrong minima, which a random start leads to where neighbours alone share points.
// Points with fewer than two rays are passed over. Empty where the solver failed, or where
// `stop`, asked after each iteration, said so.
std::map<uint32_t, Eigen::Vector3d> FindPositions(const std::vector<PointRays>& points,
                                                  int num_threads,
                                                  const std::function<bool()>& stop);

}  // namespace skein
