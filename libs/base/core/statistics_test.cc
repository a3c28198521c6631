#include "core/statistics.h"

#include <gtest/gtest.h>

#include <stdexcept>

namespace skein::statistics_test {

TEST(Statistics, PercentileInterpolatesBetweenRanks) {
  EXPECT_DOUBLE_EQ(percentile({4, 1, 3, 2}, 50), 2.5);
  EXPECT_DOUBLE_EQ(percentile({4, 1, 3, 2}, 0), 1);
  EXPECT_DOUBLE_EQ(percentile({4, 1, 3, 2}, 100), 4);
  EXPECT_DOUBLE_EQ(percentile({7}, 95), 7);
  EXPECT_DOUBLE_EQ(percentile({}, 95), 0);
  EXPECT_THROW(percentile({1}, 101), std::invalid_argument);
}

TEST(Statistics, UpperMedianIsOneOfTheSamples) {
  EXPECT_DOUBLE_EQ(UpperMedian({4, 1, 3, 2}), 3);
  EXPECT_DOUBLE_EQ(UpperMedian({9, 1, 5}), 5);
  EXPECT_DOUBLE_EQ(UpperMedian({}), 0);
}

TEST(Statistics, MeanOfNothingIsZero) {
  EXPECT_DOUBLE_EQ(mean({}), 0);
  EXPECT_DOUBLE_EQ(mean({1, 2, 6}), 3);
}

}  // namespace skein::statistics_test
