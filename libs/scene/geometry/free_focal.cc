#include "geometry/free_focal.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

namespace skein {
namespace {

constexpr size_t kMinMatches = 15;
// SIFT does not locate keypoints better.
constexpr double kMinNoisePx = 0.2;
// Focal lengths tried at first, as log factors: 0.55 to 1.8.
constexpr double kLogFocals[] = {-0.6, -0.3, 0, 0.3, 0.6};

const TwoViewFit& Better(const TwoViewFit& a, const TwoViewFit& b) {
  return b.cost < a.cost ? b : a;
}

// From the starts that fit best.
TwoViewFit FitFromStarts(const PairPixels& pixels, const TwoViewBeliefs& beliefs,
                         const std::vector<TwoViewModel>& starts, double noise_px) {
  constexpr size_t kMaxRefined = 2;
  std::vector<TwoViewFit> fits;
  for (const TwoViewModel& start : starts) {
    fits.push_back(FitOf(pixels, beliefs, start, noise_px));
  }
  std::sort(fits.begin(), fits.end(),
            [](const TwoViewFit& a, const TwoViewFit& b) { return a.cost < b.cost; });
  TwoViewFit best = fits[0];
  for (size_t i = 0; i < std::min(kMaxRefined, fits.size()); ++i) {
    best = Better(best, FitTwoView(pixels, beliefs, fits[i].model, noise_px));
  }
  return best;
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
  for (const double log_focal : kLogFocals) {
    starts.push_back(RotationBetweenRays(thinned, beliefs, log_focal));
  }
  const TwoViewFit fit = FitFromStarts(thinned, beliefs, starts, noise_px);
  for (size_t i = 0; i < thinned.size(); ++i) {
    squared_rotation.push_back(fit.residuals_px.segment<2>(2 * i).squaredNorm() /
                               (noise_px * noise_px));
  }
  return Gric(squared_rotation, kRotationDimension, kRotationParameters) + fit.belief_cost <
         Gric(squared_epipolar, kEpipolarDimension, kEpipolarParameters);
}

}  // namespace skein
