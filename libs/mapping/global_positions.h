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

// Centres of the photos, up to scale and shift. Photos and points together minimise
//   sum huber(|v_ik - d_ik (X_k - c_i)|), d_ik > 0, from a random start
// (global positioning; Pan et al., Global Structure-from-Motion Revisited, ECCV 2024, section 3.2),
// then Cauchy's loss from there, which false rays hardly move.
// Points with fewer than two rays are passed over. Empty where the solver failed, or where
// `stop`, asked after each iteration, said so.
std::map<uint32_t, Eigen::Vector3d> FindPositions(const std::vector<PointRays>& points,
                                                  int num_threads,
                                                  const std::function<bool()>& stop);

}  // namespace skein
