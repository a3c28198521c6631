#include "geometry/free_focal.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

namespace skein {
namespace {

constexpr size_t kMinMatches = 15;
// SIFT does not locate keypoints better.
constexpr double kMinNoisePx = 0.2;
// Focal lengths tried at first, as log factors: 0.5 to 2.
constexpr double kLogFocals[] = {-0.35, 0, 0.35};
constexpr double kLogRatios[] = {-0.7, -0.35, 0, 0.35, 0.7};
constexpr double kRotationLogFocals[] = {-0.6, -0.3, 0, 0.3, 0.6};

// Depths of the match's point in both cameras, at the midpoint of the rays: second = R first + t.
Eigen::Vector2d DepthsOf(const TwoViewModel& model, const Eigen::Vector3d& x,
                         const Eigen::Vector3d& y) {
  Eigen::Matrix<double, 3, 2> rays;
  rays << model.R * x, -y;
  return (rays.transpose() * rays).ldlt().solve(-(rays.transpose() * model.t));
}

int CountInFront(const PairPixels& pixels, const TwoViewBeliefs& beliefs,
                 const TwoViewModel& model) {
  int count = 0;
  for (size_t i = 0; i < pixels.size(); ++i) {
    const Eigen::Vector3d x = (pixels.first[i] / beliefs.FirstPx(model)).homogeneous();
    const Eigen::Vector3d y = (pixels.second[i] / beliefs.SecondPx(model)).homogeneous();
    count += (DepthsOf(model, x, y).array() > 0).all();
  }
  return count;
}

// The pose of the essential matrix nearest to F at these focal lengths, of its four the one with
// most points in front (Hartley and Zisserman 2004, result 9.19).
TwoViewModel PoseOf(const Eigen::Matrix3d& F, const PairPixels& pixels,
                    const TwoViewBeliefs& beliefs, double log_focal, double log_ratio) {
  TwoViewModel model;
  model.log_focal = log_focal;
  model.log_ratio = log_ratio;
  const double first_px = beliefs.FirstPx(model), second_px = beliefs.SecondPx(model);
  const Eigen::Matrix3d E = Eigen::Vector3d(second_px, second_px, 1).asDiagonal() * F *
                            Eigen::Vector3d(first_px, first_px, 1).asDiagonal();
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(E, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const Eigen::Matrix3d U = svd.matrixU() * std::copysign(1.0, svd.matrixU().determinant());
  const Eigen::Matrix3d V = svd.matrixV() * std::copysign(1.0, svd.matrixV().determinant());
  Eigen::Matrix3d W;
  W << 0, -1, 0, 1, 0, 0, 0, 0, 1;
  TwoViewModel best = model;
  int most = -1;
  for (const Eigen::Matrix3d& turn : {W, Eigen::Matrix3d(W.transpose())}) {
    for (const double sign : {1.0, -1.0}) {
      model.R = U * turn * V.transpose();
      model.t = sign * U.col(2);
      const int in_front = CountInFront(pixels, beliefs, model);
      if (in_front <= most) continue;
      most = in_front;
      best = model;
    }
  }
  return best;
}

const TwoViewFit& Better(const TwoViewFit& a, const TwoViewFit& b) {
  return b.cost < a.cost ? b : a;
}

// From the starts that fit best.
TwoViewFit FitFromStarts(const PairPixels& pixels, const TwoViewBeliefs& beliefs,
                         const std::vector<TwoViewModel>& starts,
                         const TwoViewFitOptions& options) {
  constexpr size_t kMaxRefined = 2;
  TwoViewFitOptions none = options;
  none.max_iterations = 0;
  std::vector<TwoViewFit> fits;
  for (const TwoViewModel& start : starts) {
    fits.push_back(FitTwoView(pixels, beliefs, start, none));
  }
  std::sort(fits.begin(), fits.end(),
            [](const TwoViewFit& a, const TwoViewFit& b) { return a.cost < b.cost; });
  TwoViewFit best = fits[0];
  for (size_t i = 0; i < std::min(kMaxRefined, fits.size()); ++i) {
    best = Better(best, FitTwoView(pixels, beliefs, fits[i].model, options));
  }
  return best;
}

std::vector<double> ToVector(const Eigen::VectorXd& values) {
  return {values.data(), values.data() + values.size()};
}

// Kabsch: the rotation between rays, at these focal lengths.
TwoViewModel RotationBetweenRays(const PairPixels& pixels, const TwoViewBeliefs& beliefs,
                                 double log_focal) {
  TwoViewModel model;
  model.log_focal = log_focal;
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  for (size_t i = 0; i < pixels.size(); ++i) {
    const Eigen::Vector3d x = (pixels.first[i] / beliefs.FirstPx(model)).homogeneous();
    const Eigen::Vector3d y = (pixels.second[i] / beliefs.SecondPx(model)).homogeneous();
    sum += y.normalized() * x.normalized().transpose();
  }
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(sum, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const double sign = (svd.matrixU() * svd.matrixV().transpose()).determinant();
  model.R = svd.matrixU() * Eigen::Vector3d(1, 1, sign).asDiagonal() * svd.matrixV().transpose();
  return model;
}

// Torr's criterion: capped squared residuals over the noise's variance, of matches with four
// coordinates of which the model leaves `dimension` free.
double Gric(const std::vector<double>& squared, int dimension, int num_parameters) {
  const double num_matches = static_cast<double>(squared.size());
  constexpr int kCoordinates = 4;
  const double cap = 2.0 * (kCoordinates - dimension);
  double criterion = std::log(kCoordinates) * dimension * num_matches +
                     std::log(kCoordinates * num_matches) * num_parameters;
  for (const double value : squared) criterion += std::min(value, cap);
  return criterion;
}

}  // namespace

std::optional<FocalRatio> EstimateFocalRatio(const PairPixels& pixels,
                                             const TwoViewBeliefs& beliefs) {
  if (pixels.size() < kMinMatches) return std::nullopt;
  const PairPixels thinned = Thinned(pixels);
  const Eigen::Matrix3d F = FundamentalOf(thinned);
  std::vector<TwoViewModel> free_starts, equal_starts;
  for (const double log_focal : kLogFocals) {
    for (const double log_ratio : kLogRatios) {
      free_starts.push_back(PoseOf(F, thinned, beliefs, log_focal, log_ratio));
      if (log_ratio == 0) equal_starts.push_back(free_starts.back());
    }
  }
  TwoViewFitOptions free, equal;
  equal.has_equal_ratio = true;
  TwoViewFit free_fit = FitFromStarts(thinned, beliefs, free_starts, free);
  TwoViewFit equal_fit = FitFromStarts(thinned, beliefs, equal_starts, equal);
  free.noise_px = equal.noise_px =
      std::max(kMinNoisePx, RobustSigma(ToVector(free_fit.residuals_px)));
  // Each starts where the other came to, too: the difference is then not that of two local minima.
  TwoViewModel without_ratio = free_fit.model;
  without_ratio.log_ratio = 0;
  equal_fit = Better(FitTwoView(thinned, beliefs, equal_fit.model, equal),
                     FitTwoView(thinned, beliefs, without_ratio, equal));
  free_fit = Better(FitTwoView(thinned, beliefs, free_fit.model, free),
                    FitTwoView(thinned, beliefs, equal_fit.model, free));
  return FocalRatio{free_fit.model.log_ratio, LogRatioSigma(thinned, beliefs, free_fit, free),
                    equal_fit.cost - free_fit.cost};
}

bool IsRotation(const PairPixels& pixels, const TwoViewBeliefs& beliefs) {
  if (pixels.size() < kMinMatches) return false;
  constexpr int kEpipolarDimension = 3, kEpipolarParameters = 7;
  constexpr int kRotationDimension = 2, kRotationParameters = 6;
  const PairPixels thinned = Thinned(pixels);
  std::vector<double> squared_epipolar, squared_rotation;
  const std::vector<double> errors = SampsonErrors(FundamentalOf(thinned), thinned);
  const double noise_px = std::max(kMinNoisePx, RobustSigma(errors));
  for (const double error : errors) squared_epipolar.push_back(std::pow(error / noise_px, 2));
  std::vector<TwoViewModel> starts;
  for (const double log_focal : kRotationLogFocals) {
    starts.push_back(RotationBetweenRays(thinned, beliefs, log_focal));
  }
  TwoViewFitOptions options;
  options.is_rotation = true;
  options.noise_px = noise_px;
  const TwoViewFit fit = FitFromStarts(thinned, beliefs, starts, options);
  for (size_t i = 0; i < thinned.size(); ++i) {
    squared_rotation.push_back(fit.residuals_px.segment<2>(2 * i).squaredNorm() /
                               (noise_px * noise_px));
  }
  return Gric(squared_rotation, kRotationDimension, kRotationParameters) + fit.belief_cost <
         Gric(squared_epipolar, kEpipolarDimension, kEpipolarParameters);
}

}  // namespace skein
