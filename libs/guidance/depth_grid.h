#pragma once

#include <Eigen/Core>
#include <vector>

#include "guidance/guided_map.h"

namespace skein {

struct Surfel;

// The nearest surfel in each small square of a photo: what is behind it is hidden.
class DepthGrid {
 public:
  // Squares as wide as a surfel seen from `distance`.
  DepthGrid(const GuidedCamera& camera, const CameraPose& cam_from_world, double surfel_width,
            double distance);

  void Draw(const std::vector<Surfel>& surfels);

  enum class Sight { kOutside, kHidden, kSeen };
  // `tolerance`: a part of the depth, beside a surfel's width.
  Sight Look(const Eigen::Vector3d& xyz, double tolerance) const;

 private:
  const GuidedCamera camera_;
  const Eigen::Matrix3d rotation_;
  const Eigen::Vector3d translation_;
  const double surfel_width_;
  double square_px_;
  int columns_, rows_;
  std::vector<float> depth_;
};

}  // namespace skein
