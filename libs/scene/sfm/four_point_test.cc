#include "sfm/four_point.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <stdexcept>

#include "testing/test_random.h"

namespace skein::four_point_test {

TEST(FourPoint, MapsThePointsAndAllOthersOfThePlane) {
  std::mt19937 random(1);
  for (int i = 0; i < 200; ++i) {
    Eigen::Matrix3d H = Eigen::Matrix3d::Identity();
    for (double& value : H.topRows<2>().reshaped()) value += Uniform(-0.3, 0.3, &random);
    H.topRightCorner<2, 1>() *= 500;
    H(2, 0) = Uniform(-1e-4, 1e-4, &random);
    H(2, 1) = Uniform(-1e-4, 1e-4, &random);
    std::vector<Eigen::Vector2d> first, second;
    for (int k = 0; k < 20; ++k) {
      const double x = Uniform(0, 4000, &random);
      first.emplace_back(x, Uniform(0, 3000, &random));
      second.push_back((H * first.back().homogeneous()).hnormalized());
    }
    const auto models = FourPointEstimator::Estimate({first.begin(), first.begin() + 4},
                                                     {second.begin(), second.begin() + 4});
    ASSERT_EQ(models.size(), 1u);
    EXPECT_NEAR(models[0].norm(), 1, 1e-12);
    std::vector<double> residuals;
    FourPointEstimator::Residuals(first, second, models[0], &residuals);
    EXPECT_LT(*std::max_element(residuals.begin(), residuals.begin() + 4), 1e-8);
    EXPECT_LT(*std::max_element(residuals.begin(), residuals.end()), 1);
  }
}

TEST(FourPoint, OfEqualPointsIsFinite) {
  const std::vector<Eigen::Vector2d> points(4, {100, 200});
  EXPECT_TRUE(FourPointEstimator::Estimate(points, points)[0].allFinite());
}

TEST(FourPoint, RefusesMorePoints) {
  const std::vector<Eigen::Vector2d> points(5, {100, 200});
  EXPECT_THROW(FourPointEstimator::Estimate(points, points), std::invalid_argument);
}

}  // namespace skein::four_point_test
