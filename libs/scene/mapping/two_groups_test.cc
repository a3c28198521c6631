#include "mapping/two_groups.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

namespace skein::two_groups_test {

TEST(TwoGroups, ShareLeftIsThatOfTheBestSplit) {
  // Means -1 and 1: 6 of 6 + 4 * 0.01 are explained.
  const std::vector<double> values = {1.1, -1, -1.1, 0.9, 1, -0.9};
  EXPECT_NEAR(ShareLeftByTwoGroups(values), 0.04 / 6.04, 1e-12);
  EXPECT_EQ(ShareLeftByTwoGroups({1, 2, 3, 4, 5}), 1);
  EXPECT_EQ(ShareLeftByTwoGroups({2, 2, 2, 2, 2, 2, 2}), 1);
  EXPECT_EQ(ShareLeftByTwoGroups({1, 2, NAN, 1, 2, 1, 2}), 1);
  EXPECT_EQ(ShareLeftByTwoGroups({1, 2, -INFINITY, 1, 2, 1, 2}), 1);
}

// As south-building's ten photos, five of them cropped.
TEST(TwoGroups, FindsThem) {
  const std::vector<double> log_focals = {6.457, 6.459, 6.460, 6.463, 6.463,
                                          6.766, 6.773, 6.774, 6.776, 6.778};
  EXPECT_TRUE(AreTwoGroups(log_focals));
  EXPECT_FALSE(AreTwoGroups({0, 0, 0, 1, 1, 1}));  // too few
}

TEST(TwoGroups, OneDistributionIsOneGroup) {
  for (unsigned seed = 1; seed <= 20; ++seed) {
    std::mt19937 random(seed);
    std::normal_distribution<double> normal(7, 0.01);
    std::vector<double> values(seed + 6);
    for (double& value : values) value = normal(random);
    EXPECT_FALSE(AreTwoGroups(values)) << seed;
  }
}

TEST(TwoGroups, ContinuousZoomAndPairsOfOutliersAreNoGroups) {
  EXPECT_FALSE(AreTwoGroups({0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7}));
  EXPECT_FALSE(AreTwoGroups({0.001, 0.002, 0.003, 0.004, 0.005, 0.006, 0.007, 0.008, 1, 1.2}));
  EXPECT_FALSE(AreTwoGroups(std::vector<double>(9, 7.0)));
}

}  // namespace skein::two_groups_test
