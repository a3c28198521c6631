#include "export/overviews.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace skein {
namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

TEST(Overviews, HalveUntilTheLongerSideFits) {
  const std::vector<cv::Mat> levels = WithOverviews(cv::Mat1f(600, 1025, 0.0f), 256);
  ASSERT_EQ(levels.size(), 4U);
  EXPECT_EQ(levels[1].size(), cv::Size(513, 300));
  EXPECT_EQ(levels[2].size(), cv::Size(257, 150));
  EXPECT_EQ(levels[3].size(), cv::Size(129, 75));
  EXPECT_EQ(WithOverviews(cv::Mat1f(256, 256, 0.0f), 256).size(), 1U);
}

TEST(Overviews, AHeightIsTheMeanOfKnownOnes) {
  const cv::Mat1f heights = (cv::Mat1f(2, 5) << 1, 2, 8, kNan, kNan, 3, 6, kNan, kNan, kNan);
  const cv::Mat1f half = WithOverviews(heights, 3).back();
  ASSERT_EQ(half.size(), cv::Size(3, 1));
  EXPECT_EQ(half(0, 0), 3);
  EXPECT_EQ(half(0, 1), 8);
  EXPECT_TRUE(std::isnan(half(0, 2)));
}

TEST(Overviews, ATransparentPixelHasNoShareInAColour) {
  cv::Mat4b colours(2, 4, cv::Vec4b(0, 0, 0, 0));
  colours(0, 0) = cv::Vec4b(10, 20, 30, 255);
  colours(1, 1) = cv::Vec4b(30, 40, 50, 255);
  const cv::Mat4b half = WithOverviews(colours, 2).back();
  EXPECT_EQ(half(0, 0), cv::Vec4b(20, 30, 40, 255));
  EXPECT_EQ(half(0, 1), cv::Vec4b(0, 0, 0, 0));
}

TEST(Overviews, AShadeIsTheMeanOfKnownOnes) {
  const cv::Mat1b shades = (cv::Mat1b(2, 4) << 0, 180, 0, 0, 0, 182, 0, 0);
  const cv::Mat1b half = WithOverviews(shades, 2).back();
  EXPECT_EQ(half(0, 0), 181);
  EXPECT_EQ(half(0, 1), 0);
}

}  // namespace
}  // namespace skein
