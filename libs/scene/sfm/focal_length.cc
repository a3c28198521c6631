#include "sfm/focal_length.h"

#include <Eigen/Dense>
#include <cmath>

#include "sfm/colmap_api.h"

namespace skein {
namespace {

// The first two rows of the pose are a n0 + b n1 + n2, up to scale. Of a quadratic form in (a, b,
// 1) the factors of b^2, of b and of one, the last two by powers of a, highest first.
double FactorOfBb(const Eigen::Matrix3d& form) { return form(1, 1); }
Eigen::Vector2d FactorOfB(const Eigen::Matrix3d& form) {
  return Eigen::Vector2d(2 * form(0, 1), 2 * form(1, 2));
}
Eigen::Vector3d FactorOfOne(const Eigen::Matrix3d& form) {
  return Eigen::Vector3d(form(0, 0), 2 * form(0, 2), form(2, 2));
}

// Of two polynomials.
template <int N, int M>
Eigen::Matrix<double, N + M - 1, 1> Product(const Eigen::Matrix<double, N, 1>& p,
                                            const Eigen::Matrix<double, M, 1>& q) {
  Eigen::Matrix<double, N + M - 1, 1> product = Eigen::Matrix<double, N + M - 1, 1>::Zero();
  for (int i = 0; i < N; ++i) product.template segment<M>(i) += p[i] * q;
  return product;
}

// The real (a, b) where both are zero. Without b^2 they give b = -n(a) / d(a), which leaves a
// quartic in a.
std::vector<Eigen::Vector2d> CommonZeros(const Eigen::Matrix3d& p, const Eigen::Matrix3d& q) {
  const Eigen::Vector2d d = FactorOfBb(q) * FactorOfB(p) - FactorOfBb(p) * FactorOfB(q);
  const Eigen::Vector3d n = FactorOfBb(q) * FactorOfOne(p) - FactorOfBb(p) * FactorOfOne(q);
  const Eigen::Matrix<double, 5, 1> quartic = FactorOfBb(p) * Product<3, 3>(n, n) -
                                              Product<3, 3>(Product<2, 2>(FactorOfB(p), d), n) +
                                              Product<3, 3>(FactorOfOne(p), Product<2, 2>(d, d));
  Eigen::VectorXd real, imaginary;
  if (!colmap::FindPolynomialRootsCompanionMatrix(quartic, &real, &imaginary)) {
    return std::vector<Eigen::Vector2d>();
  }
  std::vector<Eigen::Vector2d> zeros;
  for (Eigen::Index i = 0; i < real.size(); ++i) {
    constexpr double kMaxImaginary = 1e-6;
    if (std::abs(imaginary[i]) > kMaxImaginary * (1 + std::abs(real[i]))) continue;
    zeros.emplace_back(
        real[i], -colmap::EvaluatePolynomial(n, real[i]) / colmap::EvaluatePolynomial(d, real[i]));
  }
  return zeros;
}

// Rows x (r2 X + t2) - y (r1 X + t1) = 0; the null space of five.
Eigen::Matrix<double, 8, 3> NullSpace(const std::vector<Eigen::Vector2d>& pixels,
                                      const std::vector<Eigen::Vector3d>& points) {
  Eigen::Matrix<double, 8, 5> transposed;
  for (int i = 0; i < 5; ++i) {
    transposed.col(i) << -pixels[i].y() * points[i].homogeneous(),
        pixels[i].x() * points[i].homogeneous();
  }
  const Eigen::Matrix<double, 8, 8> q = transposed.householderQr().householderQ();
  return q.rightCols<3>();
}

// The third row of the translation and the focal length: r (r3 X + t3) = f |(r1 X + t1, r2 X + t2)|
// for a pixel that is r from the principal point. False if a point is behind the camera.
bool Complete(const std::vector<Eigen::Vector2d>& pixels,
              const std::vector<Eigen::Vector3d>& points, FocalPoseEstimator::M_t* model) {
  Eigen::Matrix<double, 3, 4>& pose = model->cam_from_world;
  pose.block<1, 3>(2, 0) = pose.block<1, 3>(0, 0).cross(pose.block<1, 3>(1, 0));
  pose(2, 3) = 0;
  Eigen::Matrix<double, 5, 2> factors;
  Eigen::Matrix<double, 5, 1> right;
  for (int i = 0; i < 5; ++i) {
    const Eigen::Vector3d in_camera = pose * points[i].homogeneous();
    if (in_camera.head<2>().dot(pixels[i]) <= 0) return false;
    const double radius = pixels[i].norm();
    factors.row(i) << radius, -in_camera.head<2>().norm();
    right[i] = -radius * in_camera.z();
  }
  const Eigen::Vector2d solved =
      (factors.transpose() * factors).inverse() * (factors.transpose() * right);
  if (!solved.allFinite() || solved[1] <= 0) return false;
  pose(2, 3) = solved[0];
  model->focal_px = solved[1];
  for (int i = 0; i < 5; ++i) {
    if (pose.row(2) * points[i].homogeneous() <= 0) return false;
  }
  return true;
}

}  // namespace

std::vector<FocalPoseEstimator::M_t> FocalPoseEstimator::Estimate(const std::vector<X_t>& pixels,
                                                                  const std::vector<Y_t>& points) {
  const Eigen::Matrix<double, 8, 3> basis = NullSpace(pixels, points);
  const Eigen::Matrix3d r1 = basis.topRows<3>(), r2 = basis.middleRows<3>(4);
  const Eigen::Matrix3d dots = r1.transpose() * r2;
  const Eigen::Matrix3d orthogonal = 0.5 * (dots + dots.transpose());
  const Eigen::Matrix3d equally_long = r1.transpose() * r1 - r2.transpose() * r2;
  std::vector<M_t> models;
  for (const Eigen::Vector2d& zero : CommonZeros(orthogonal, equally_long)) {
    Eigen::Matrix<double, 8, 1> rows = basis * zero.homogeneous();
    rows /= rows.head<3>().norm();
    const Eigen::Vector4d first = rows.head<4>(), second = rows.tail<4>();
    const double along = first.dot(points[0].homogeneous()) * pixels[0].x() +
                         second.dot(points[0].homogeneous()) * pixels[0].y();
    M_t model;
    model.cam_from_world.row(0) = std::copysign(1.0, along) * first;
    model.cam_from_world.row(1) = std::copysign(1.0, along) * second;
    if (rows.allFinite() && Complete(pixels, points, &model)) models.push_back(model);
  }
  return models;
}

void FocalPoseEstimator::Residuals(const std::vector<X_t>& pixels, const std::vector<Y_t>& points,
                                   const M_t& model, std::vector<double>* residuals) {
  residuals->resize(pixels.size());
  for (size_t i = 0; i < pixels.size(); ++i) {
    const Eigen::Vector3d in_camera = model.cam_from_world * points[i].homogeneous();
    (*residuals)[i] = in_camera.z() > 0
                          ? (model.focal_px * in_camera.hnormalized() - pixels[i]).squaredNorm()
                          : HUGE_VAL;
  }
}

std::optional<double> EstimateFocalLength(const RansacLimits& limits,
                                          const std::vector<Eigen::Vector2d>& pixels,
                                          const std::vector<Eigen::Vector3d>& points) {
  colmap::RANSAC<colmap_api::ForRansac<FocalPoseEstimator>> ransac(colmap_api::ToColmap(limits));
  const auto report = ransac.Estimate(pixels, points);
  if (!report.success || report.support.num_inliers < 3 * FocalPoseEstimator::kMinNumSamples) {
    return std::nullopt;
  }
  return report.model.focal_px;
}

}  // namespace skein
