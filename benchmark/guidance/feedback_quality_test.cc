#include "benchmark/guidance/feedback_quality.h"

#include <gtest/gtest.h>

namespace skein::feedback_quality_test {

TEST(FeedbackQuality, IsOneForTheBestAndZeroForTheWorst) {
  const std::vector<double> q = FeedbackQuality({{2, 0.02, 0.9}, {8, 0.01, 0.3}, {5, 0.02, 0.3}});
  EXPECT_DOUBLE_EQ(q[0], 0);
  EXPECT_DOUBLE_EQ(q[1], 1);
  EXPECT_DOUBLE_EQ(q[2], 0.8 * 0.5 + 0.1);
  EXPECT_TRUE(FeedbackQuality({}).empty());
}

}  // namespace skein::feedback_quality_test
