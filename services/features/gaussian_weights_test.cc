#include "features/gaussian_weights.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>

namespace skein::gaussian_weights_test {

double Sum(const std::vector<float>& weights) {
  return std::accumulate(weights.begin(), weights.end(), 0.0);
}

TEST(GaussianWeights, HaveTheWholeGaussiansVariance) {
  for (const double sigma : {0.6, 1.2, 1.9, 3.1}) {
    const auto weights = GaussianWeights(sigma);
    const int radius = static_cast<int>(weights.size()) / 2;
    double variance = 0;
    for (int k = -radius; k <= radius; ++k) variance += k * k * weights[k + radius];
    EXPECT_NEAR(Sum(weights), 1, 1e-5) << sigma;
    EXPECT_NEAR(variance, sigma * sigma, 1e-4 * sigma * sigma) << sigma;
    EXPECT_EQ(weights.front(), weights.back());
  }
}

TEST(GaussianWeights, BlurOfTheDoubledImageKeepsBrightnessAndPlace) {
  const DoublingWeights weights = BlurOfDoubled(1.3);
  double even_place = 0, odd_place = 0;
  for (size_t i = 0; i < weights.even.size(); ++i) {
    const double at = static_cast<double>(i) - weights.radius;
    even_place += at * weights.even[i];
    odd_place += at * weights.odd[i];
  }
  EXPECT_NEAR(Sum(weights.even), 1, 1e-5);
  EXPECT_NEAR(Sum(weights.odd), 1, 1e-5);
  EXPECT_NEAR(even_place, 0, 1e-5);
  EXPECT_NEAR(odd_place, 0.5, 1e-5);
}

TEST(GaussianWeights, BlursOfAnOctaveDoubleItsSigma) {
  const OctaveBlurs blurs(1.6);
  double variance = 1.6 * 1.6;
  for (int level = 1; level <= kOctaveLayers; ++level) {
    const int radius = blurs.radius(level);
    ASSERT_LE(radius, kMaxBlurRadius);
    for (int k = -radius; k <= radius; ++k) variance += k * k * blurs.weights[level][k + radius];
  }
  EXPECT_NEAR(std::sqrt(variance), 3.2, 1e-4);
}

}  // namespace skein::gaussian_weights_test
