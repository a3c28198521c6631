// Whether another depth map shows the surface that a depth map shows.
#pragma once

#include <Eigen/Core>
#include <optional>

#include "depth/depth_map.h"

namespace skein {

// Another map agrees if its depth at the point differs by at most this part, and its point lies at
// most this far from the pixel.
constexpr float kMaxDepthDifference = 0.01f;
constexpr float kMaxReprojectionPx = 1;

// A pixel and a depth of one map as another map's camera sees them. In pixels whose first centre is
// at (0, 0): (z u, z v, z) of the other camera.
class Transfer {
 public:
  Transfer(const DepthMap& from, const DepthMap& to);

  Eigen::Vector3f Apply(float x, float y, float depth) const {
    return depth * (of_pixel_ * Eigen::Vector3f(x, y, 1)) + shift_;
  }

 private:
  Eigen::Matrix3f of_pixel_;  // times depth
  Eigen::Vector3f shift_;
};

struct DepthEstimate {
  double depth = 0, error = 0;
};

// Between two maps, which must outlive it.
class Agreement {
 public:
  Agreement(const DepthMap& map, const DepthMap& other);

  // The other map's estimate of a pixel's depth, if it agrees.
  std::optional<DepthEstimate> Find(int x, int y, float depth) const;

 private:
  const DepthMap& other_;
  const Transfer there_, back_;
};

}  // namespace skein
