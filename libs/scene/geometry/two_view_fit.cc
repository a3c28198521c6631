#include "geometry/two_view_fit.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <utility>

#include "core/limits.h"
#include "core/statistics.h"

namespace skein {
namespace {

constexpr int kNumParameters =
    8;  // rotation 3, translation's direction 2, focal, ratio, distortion
constexpr int kTranslation = 3, kFocal = 5, kRatio = 6, kDistortion = 7;
using Step = Eigen::Matrix<double, kNumParameters, 1>;
using Information = Eigen::Matrix<double, kNumParameters, kNumParameters>;

constexpr double kBehindPx = 1e3;  // residual of a point that a rotation turns behind the camera
constexpr double kLossScale = 2;   // standard deviations
constexpr double kNumericStep = 1e-6;  // of derivatives

Eigen::Vector3d RayOf(const Eigen::Vector2d& pixel, double focal_px, double distortion) {
  constexpr int kFixedPointIterations = 4;
  const Eigen::Vector2d distorted = pixel / focal_px;
  Eigen::Vector2d point = distorted;
  for (int i = 0; i < kFixedPointIterations; ++i) {
    point = distorted / (1 + distortion * point.squaredNorm());
  }
  return point.homogeneous();
}

TwoViewModel Moved(const TwoViewModel& model, const Step& step) {
  TwoViewModel moved = model;
  const double angle = step.head<3>().norm();
  if (angle > 0) {
    moved.R = Eigen::AngleAxisd(angle, step.head<3>() / angle).matrix() * model.R;
  }
  moved.log_focal += step[kFocal];
  moved.log_ratio += step[kRatio];
  moved.distortion += step[kDistortion];
  return moved;
}

class Problem {
 public:
  Problem(const PairPixels& pixels, const TwoViewBeliefs& beliefs, double noise_px)
      : pixels_(pixels), beliefs_(beliefs), noise_px_(noise_px) {}

  TwoViewFit At(const TwoViewModel& model) const {
    TwoViewFit fit;
    fit.model = model;
    fit.residuals_px = Residuals(model);
    fit.cost = fit.belief_cost = BeliefCost(model);
    for (Eigen::Index i = 0; i < NumTerms(fit); ++i) {
      fit.cost += kLossScale * kLossScale * std::log1p(ScaledSquare(fit, i));
    }
    return fit;
  }

  // Gauss-Newton's normal equations, robustly weighted.
  void Linearize(const TwoViewFit& fit, Information* A, Step* b) const {
    Eigen::Matrix<double, Eigen::Dynamic, kNumParameters> J(fit.residuals_px.size(),
                                                            kNumParameters);
    J.setZero();
    for (int j = 0; j < kNumParameters; ++j) {
      const TwoViewModel moved = Moved(fit.model, kNumericStep * Step::Unit(j));
      J.col(j) = (Residuals(moved) - fit.residuals_px) / kNumericStep;
    }
    A->setZero();
    b->setZero();
    const double information = 1 / (noise_px_ * noise_px_);
    for (Eigen::Index i = 0; i < NumTerms(fit); ++i) {
      const auto rows = J.middleRows<2>(2 * i);
      const double weight = information / (1 + ScaledSquare(fit, i));
      *A += weight * rows.transpose() * rows;
      *b += weight * rows.transpose() * fit.residuals_px.segment<2>(2 * i);
    }
    AddBeliefs(fit.model, A, b);
  }

 private:
  static Eigen::Index NumTerms(const TwoViewFit& fit) { return fit.residuals_px.size() / 2; }
  double ScaledSquare(const TwoViewFit& fit, Eigen::Index i) const {
    const double scale = kLossScale * noise_px_;
    return fit.residuals_px.segment<2>(2 * i).squaredNorm() / (scale * scale);
  }

  Eigen::VectorXd Residuals(const TwoViewModel& model) const {
    const double first_px = beliefs_.FirstPx(model), second_px = beliefs_.SecondPx(model);
    const double norm = std::hypot(1, second_px / first_px);
    Eigen::VectorXd residuals(2 * pixels_.size());
    for (size_t i = 0; i < pixels_.size(); ++i) {
      const Eigen::Vector3d y = model.R * RayOf(pixels_.first[i], first_px, model.distortion);
      constexpr double kMinDepth = 1e-3;
      if (y.z() < kMinDepth) {
        residuals.segment<2>(2 * i).setConstant(kBehindPx);
        continue;
      }
      const Eigen::Vector2d point = y.hnormalized();
      const double distorted_px = second_px * (1 + model.distortion * point.squaredNorm());
      residuals.segment<2>(2 * i) = (distorted_px * point - pixels_.second[i]) / norm;
    }
    return residuals;
  }

  double BeliefCost(const TwoViewModel& model) const {
    const double first = (model.log_focal - model.log_ratio / 2) / beliefs_.first.sigma;
    const double second = (model.log_focal + model.log_ratio / 2) / beliefs_.second.sigma;
    const double distortion = model.distortion / limits::kDistortionSigma;
    return first * first + second * second + distortion * distortion;
  }

  void AddBeliefs(const TwoViewModel& model, Information* A, Step* b) const {
    const auto add = [&](double by_focal, double by_ratio, double by_distortion, double sigma) {
      Step gradient = Step::Zero();
      gradient[kFocal] = by_focal / sigma;
      gradient[kRatio] = by_ratio / sigma;
      gradient[kDistortion] = by_distortion / sigma;
      const double value = gradient[kFocal] * model.log_focal + gradient[kRatio] * model.log_ratio +
                           gradient[kDistortion] * model.distortion;
      *A += gradient * gradient.transpose();
      *b += value * gradient;
    };
    add(1, -0.5, 0, beliefs_.first.sigma);
    add(1, 0.5, 0, beliefs_.second.sigma);
    add(0, 0, 1, limits::kDistortionSigma);
  }

  const PairPixels& pixels_;
  const TwoViewBeliefs beliefs_;
  const double noise_px_;
};

// Hartley's: the centroid at the origin, the mean distance from it sqrt(2).
Eigen::Matrix3d Normalization(const std::vector<Eigen::Vector2d>& pixels) {
  Eigen::Vector2d center = Eigen::Vector2d::Zero();
  for (const Eigen::Vector2d& pixel : pixels) center += pixel / static_cast<double>(pixels.size());
  double distance = 0;
  for (const Eigen::Vector2d& pixel : pixels) {
    distance += (pixel - center).norm() / static_cast<double>(pixels.size());
  }
  const double scale = std::sqrt(2.0) / std::max(distance, 1e-9);
  Eigen::Matrix3d matrix;
  matrix << scale, 0, -scale * center.x(), 0, scale, -scale * center.y(), 0, 0, 1;
  return matrix;
}

}  // namespace

PairPixels Thinned(const PairPixels& pixels) {
  constexpr size_t kMaxMatches = 100;
  const size_t count = std::min(kMaxMatches, pixels.size());
  PairPixels thinned;
  for (size_t i = 0; i < count; ++i) {
    thinned.first.push_back(pixels.first[i * pixels.size() / count]);
    thinned.second.push_back(pixels.second[i * pixels.size() / count]);
  }
  return thinned;
}

double TwoViewBeliefs::FirstPx(const TwoViewModel& model) const {
  return first.focal_px * std::exp(model.log_focal - model.log_ratio / 2);
}

double TwoViewBeliefs::SecondPx(const TwoViewModel& model) const {
  return second.focal_px * std::exp(model.log_focal + model.log_ratio / 2);
}

TwoViewFit FitTwoView(const PairPixels& pixels, const TwoViewBeliefs& beliefs,
                      const TwoViewModel& start, double noise_px) {
  constexpr int kMaxIterations = 15;
  constexpr double kTolerance = 1e-4;  // relative decrease of the cost at which it has converged
  constexpr int kMaxTries = 6;
  const Problem problem(pixels, beliefs, noise_px);
  TwoViewFit best = problem.At(start);
  double damping = 1e-3;
  for (int i = 0; i < kMaxIterations; ++i) {
    Information A;
    Step b;
    problem.Linearize(best, &A, &b);
    const double before = best.cost;
    for (int j = 0; j < kMaxTries && best.cost == before; ++j) {
      Information damped = A;
      damped.diagonal() *= 1 + damping;
      const TwoViewFit moved = problem.At(Moved(best.model, -damped.ldlt().solve(b)));
      const bool is_better = moved.cost < before;
      damping *= is_better ? 0.3 : 8;
      if (is_better) best = moved;
    }
    if (before - best.cost <= kTolerance * before) break;
  }
  return best;
}

TwoViewFit FitOf(const PairPixels& pixels, const TwoViewBeliefs& beliefs, const TwoViewModel& model,
                 double noise_px) {
  return Problem(pixels, beliefs, noise_px).At(model);
}

Eigen::Matrix3d FundamentalOf(const PairPixels& pixels) {
  const Eigen::Matrix3d first = Normalization(pixels.first), second = Normalization(pixels.second);
  Eigen::Matrix<double, 9, 9> normal = Eigen::Matrix<double, 9, 9>::Zero();
  for (size_t i = 0; i < pixels.size(); ++i) {
    const Eigen::Vector3d x = first * pixels.first[i].homogeneous();
    const Eigen::Vector3d y = second * pixels.second[i].homogeneous();
    Eigen::Matrix<double, 9, 1> row;
    row << y.x() * x, y.y() * x, x;
    normal += row * row.transpose();
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, 9, 9>> eigen(normal);
  Eigen::Matrix3d F;
  F << eigen.eigenvectors().col(0).segment<3>(0).transpose(),
      eigen.eigenvectors().col(0).segment<3>(3).transpose(),
      eigen.eigenvectors().col(0).segment<3>(6).transpose();
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(F, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Vector3d singular = svd.singularValues();
  singular[2] = 0;
  F = svd.matrixU() * singular.asDiagonal() * svd.matrixV().transpose();
  return second.transpose() * F * first;
}

std::vector<double> SampsonErrors(const Eigen::Matrix3d& F, const PairPixels& pixels) {
  std::vector<double> errors;
  for (size_t i = 0; i < pixels.size(); ++i) {
    const Eigen::Vector3d x = pixels.first[i].homogeneous(), y = pixels.second[i].homogeneous();
    const Eigen::Vector3d line_y = F * x, line_x = F.transpose() * y;
    errors.push_back(y.dot(line_y) /
                     std::sqrt(line_y.head<2>().squaredNorm() + line_x.head<2>().squaredNorm()));
  }
  return errors;
}

double RobustSigma(const std::vector<double>& errors) {
  constexpr double kSigmaOfMedian = 1.4826;  // of a normal distribution's median magnitude
  std::vector<double> magnitudes;
  for (const double error : errors) magnitudes.push_back(std::abs(error));
  return kSigmaOfMedian * UpperMedian(std::move(magnitudes));
}

}  // namespace skein
