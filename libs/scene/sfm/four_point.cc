#include "sfm/four_point.h"

#include <Eigen/QR>
#include <stdexcept>

#include "sfm/colmap_api.h"

namespace skein {

// What is orthogonal to the eight constraints. Four points are met exactly, so pixels need no
// normalisation.
std::vector<Eigen::Matrix3d> FourPointEstimator::Estimate(
    const std::vector<Eigen::Vector2d>& points1, const std::vector<Eigen::Vector2d>& points2) {
  if (points1.size() != kMinNumSamples || points2.size() != kMinNumSamples) {
    throw std::invalid_argument("four points are wanted");
  }
  Eigen::Matrix<double, 9, 8> constraints = Eigen::Matrix<double, 9, 8>::Zero();
  for (int i = 0; i < 4; ++i) {
    const Eigen::Vector3d x1 = points1[i].homogeneous();
    constraints.col(2 * i) << x1, Eigen::Vector3d::Zero(), -points2[i].x() * x1;
    constraints.col(2 * i + 1) << Eigen::Vector3d::Zero(), x1, -points2[i].y() * x1;
  }
  const Eigen::HouseholderQR<Eigen::Matrix<double, 9, 8>> qr(constraints);
  Eigen::Matrix<double, 9, 1> h = Eigen::Matrix<double, 9, 1>::Unit(8);
  h.applyOnTheLeft(qr.householderQ());
  return {Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(h.data())};
}

void FourPointEstimator::Residuals(const std::vector<Eigen::Vector2d>& points1,
                                   const std::vector<Eigen::Vector2d>& points2,
                                   const Eigen::Matrix3d& H, std::vector<double>* residuals) {
  colmap::HomographyMatrixEstimator::Residuals(points1, points2, H, residuals);
}

}  // namespace skein
