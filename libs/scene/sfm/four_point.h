#pragma once

// Homography of four points by the direct linear transform (Hartley and Zisserman 2004, algorithm
// 4.1), for COLMAP's RANSAC. COLMAP's own estimator solves the same by a singular value
// decomposition, in several times the time. For more points COLMAP's estimator is used.

#include <Eigen/Core>
#include <vector>

namespace skein {

class FourPointEstimator {
 public:
  using X_t = Eigen::Vector2d;  // pixels of photo 1
  using Y_t = Eigen::Vector2d;  // pixels of photo 2
  using M_t = Eigen::Matrix3d;  // x2 ~ H x1, of Frobenius norm 1

  static constexpr int kMinNumSamples = 4;

  // The one homography of exactly four points.
  static std::vector<M_t> Estimate(const std::vector<X_t>& points1,
                                   const std::vector<Y_t>& points2);

  // Squared distances in photo 2.
  static void Residuals(const std::vector<X_t>& points1, const std::vector<Y_t>& points2,
                        const M_t& H, std::vector<double>* residuals);
};

}  // namespace skein
