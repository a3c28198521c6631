#pragma once

// Non-linear fits of a rotation between two photos whose focal lengths and lens are not known for
// certain.

#include <Eigen/Core>
#include <vector>

namespace skein {

// Matched points of two photos, in px from the photos' principal points; as many in each.
struct PairPixels {
  std::vector<Eigen::Vector2d> first, second;
  size_t size() const { return first.size(); }
};

// At most 100 matches, spread evenly. Neighbours share errors of localisation, lens and matching,
// so more would not say more.
PairPixels Thinned(const PairPixels& pixels);

// Prior of a photo's focal length: its logarithm is normally distributed.
struct FocalBelief {
  double focal_px = 0;
  double sigma = 0;
};

struct TwoViewModel {
  Eigen::Matrix3d R = Eigen::Matrix3d::Identity();  // of the second photo's camera from the first's
  // log_focal = (log(f1 / g1) + log(f2 / g2)) / 2, log_ratio = log(f2 / g2) - log(f1 / g1); f1, f2:
  // focal lengths, g1, g2: those believed.
  double log_focal = 0;
  double log_ratio = 0;
  double distortion = 0;  // SIMPLE_RADIAL's, of both photos
};

struct TwoViewBeliefs {
  FocalBelief first, second;

  double FirstPx(const TwoViewModel& model) const;
  double SecondPx(const TwoViewModel& model) const;
};

struct TwoViewFit {
  TwoViewModel model;
  // Two a match, in the second photo, divided so that their standard deviation is that of a point's
  // coordinates.
  Eigen::VectorXd residuals_px;
  // Minus twice the log likelihood, up to a constant: robust squared residuals over the noise's
  // variance (Cauchy's loss from 2 standard deviations on), and the beliefs.
  double cost = 0;
  double belief_cost = 0;  // the part of it that the beliefs make
};

// Levenberg-Marquardt from `start`, at most 15 steps. `noise_px`: standard deviation of a point's
// coordinates.
TwoViewFit FitTwoView(const PairPixels& pixels, const TwoViewBeliefs& beliefs,
                      const TwoViewModel& start, double noise_px);

// The fit of `model` itself.
TwoViewFit FitOf(const PairPixels& pixels, const TwoViewBeliefs& beliefs, const TwoViewModel& model,
                 double noise_px);

// Fundamental matrix by the normalised eight-point algorithm (Hartley 1997), of 8 matches or more.
Eigen::Matrix3d FundamentalOf(const PairPixels& pixels);

// Signed Sampson errors, px.
std::vector<double> SampsonErrors(const Eigen::Matrix3d& F, const PairPixels& pixels);

// Standard deviation of normally distributed errors with outliers, by their median magnitude.
double RobustSigma(const std::vector<double>& errors);

}  // namespace skein
