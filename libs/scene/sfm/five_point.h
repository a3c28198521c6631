#pragma once

// Essential matrices of five points (Nister 2004, "An efficient solution to the five-point relative
// pose problem"), for COLMAP's RANSAC. COLMAP's own estimator does the same with singular value
// decompositions and the eigenvalues of a 10 x 10 matrix, in four times the time. For more points
// COLMAP's estimator is used.

#include <Eigen/Core>
#include <array>
#include <vector>

namespace skein {

class FivePointEstimator {
 public:
  using X_t = Eigen::Vector2d;  // in camera 1, on the plane z = 1
  using Y_t = Eigen::Vector2d;  // in camera 2
  using M_t = Eigen::Matrix3d;  // x2' E x1 = 0, of Frobenius norm 1

  static constexpr int kMinNumSamples = 5;

  // At most ten, of exactly five points; none where these are degenerate.
  static std::vector<M_t> Estimate(const std::vector<X_t>& points1,
                                   const std::vector<Y_t>& points2);

  // Squared Sampson errors.
  static void Residuals(const std::vector<X_t>& points1, const std::vector<Y_t>& points2,
                        const M_t& E, std::vector<double>* residuals);
};

// Simple real roots of sum_i coefficients[i] z^i in any order; no multiple ones. Roots are isolated
// by Descartes' rule of signs on Bernstein coefficients and bisection (Rouillier and Zimmermann
// 2004, "Efficient isolation of polynomial's real roots"), then refined by Newton's method.
std::vector<double> RealRoots(const std::array<double, 11>& coefficients);

}  // namespace skein
