#include "features/gaussian_weights.h"

#include <algorithm>
#include <cmath>

namespace skein {
namespace {

constexpr double kDeviations = 3;
// Blur that a photo is taken to have, its pixels (Lowe 2004, section 3.3).
constexpr double kPhotoSigma = 0.5;
// OpenCV's doubling blurs by 1/4 pixel^2 more than ours; kept, so that as many features are found.
constexpr double kMoreVariance = 0.5;

std::vector<double> Sampled(double sigma, int radius) {
  std::vector<double> weights;
  double sum = 0;
  for (int k = -radius; k <= radius; ++k) {
    weights.push_back(std::exp(-k * k / (2 * sigma * sigma)));
    sum += weights.back();
  }
  for (double& weight : weights) weight /= sum;
  return weights;
}

double Variance(const std::vector<double>& weights, int radius) {
  double variance = 0;
  for (int k = -radius; k <= radius; ++k) variance += k * k * weights[k + radius];
  return variance;
}

// The cut makes the variance smaller: the sampled Gaussian is made wider until it is right.
std::vector<double> Weights(double sigma) {
  const int radius = static_cast<int>(std::ceil(kDeviations * sigma));
  double sampled_sigma = sigma;
  std::vector<double> weights = Sampled(sigma, radius);
  for (int i = 0; i < 20; ++i) {
    sampled_sigma *= sigma / std::sqrt(Variance(weights, radius));
    weights = Sampled(sampled_sigma, radius);
  }
  return weights;
}

double LevelSigma(double sigma, int level) {
  return sigma * std::pow(2.0, static_cast<double>(level) / kOctaveLayers);
}

}  // namespace

std::vector<float> GaussianWeights(double sigma) {
  const std::vector<double> weights = Weights(sigma);
  return {weights.begin(), weights.end()};
}

DoublingWeights BlurOfDoubled(double sigma) {
  const std::vector<double> blur = Weights(sigma);
  const int blur_radius = static_cast<int>(blur.size()) / 2;
  // With the interpolation's (1/2, 1, 1/2); 0 beyond its ends.
  const auto weight = [&](int k) {
    double sum = 0;
    for (int step = -1; step <= 1; ++step) {
      const int at = k + step + blur_radius;
      if (at < 0 || at > 2 * blur_radius) continue;
      sum += blur[at] * (step == 0 ? 1 : 0.5);
    }
    return sum;
  };
  DoublingWeights result;
  result.radius = (blur_radius + 1) / 2;
  for (int k = -result.radius; k <= result.radius + 1; ++k) {
    result.even.push_back(static_cast<float>(weight(2 * k)));
    result.odd.push_back(static_cast<float>(weight(2 * k - 1)));
  }
  return result;
}

OctaveBlurs::OctaveBlurs(double sigma)
    : first(BlurOfDoubled(std::sqrt(std::max(sigma * sigma - 4 * kPhotoSigma * kPhotoSigma, 0.01) +
                                    kMoreVariance))) {
  for (int level = 1; level < kGaussianLevels; ++level) {
    const double before = LevelSigma(sigma, level - 1), now = LevelSigma(sigma, level);
    weights[level] = GaussianWeights(std::sqrt(now * now - before * before));
  }
}

}  // namespace skein
