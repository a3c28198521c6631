#include "benchmark/guidance/rank_correlation.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace skein::rank_correlation_test {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

TEST(RankCorrelation, IsOneForAnyMonotonicFunction) {
  EXPECT_DOUBLE_EQ(SpearmanCorrelation({1, 2, 3, 4}, {1, 8, 27, kInfinity}), 1);
  EXPECT_DOUBLE_EQ(SpearmanCorrelation({1, 2, 3, 4}, {5, 3, 2, -1}), -1);
}

TEST(RankCorrelation, EqualValuesShareTheirRank) {
  // Ranks 1.5 1.5 3 4 against 1 2 3 4: covariance 4.5, variances 4.5 and 5.
  EXPECT_NEAR(SpearmanCorrelation({1, 1, 2, 3}, {1, 2, 3, 4}), 4.5 / std::sqrt(4.5 * 5), 1e-12);
}

TEST(RankCorrelation, OfConstantsIsZero) {
  EXPECT_EQ(SpearmanCorrelation({2, 2, 2}, {1, 2, 3}), 0);
  EXPECT_EQ(SpearmanCorrelation({1, 2}, {1, 2}), 0);
}

TEST(AreaUnderRoc, CountsPairsInTheRightOrder) {
  EXPECT_DOUBLE_EQ(AreaUnderRoc({1, 2, 3, 4}, {false, false, true, true}), 1);
  EXPECT_DOUBLE_EQ(AreaUnderRoc({1, 3, 2, 4}, {false, false, true, true}), 0.75);
  EXPECT_DOUBLE_EQ(AreaUnderRoc({1, 1, 1}, {false, true, true}), 0.5);
  EXPECT_DOUBLE_EQ(AreaUnderRoc({1, 2}, {true, true}), 0.5);
}

}  // namespace skein::rank_correlation_test
