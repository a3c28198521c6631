#include "depth/hillshade.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace skein::depth_test {
namespace {

constexpr int kLevel = 181;  // 1 + 254 sin 45

// Rises by `east` and `north` a unit; cells of half a unit.
cv::Mat1b ShadesOfPlane(double east, double north) {
  cv::Mat1f height(5, 6);
  for (int row = 0; row < height.rows; ++row) {
    for (int column = 0; column < height.cols; ++column) {
      height(row, column) = static_cast<float>(100 + 0.5 * (east * column - north * row));
    }
  }
  return Hillshade(height, 0.5);
}

TEST(Hillshade, APlaneHasOneShadeUpToItsBorder) {
  // cos = (sin 45 + cos 45 (slope towards the light)) / sqrt(1 + slope^2)
  const auto expected = [](double east, double north) {
    const double half = std::sqrt(0.5), towards = half * (east - north);
    const double cosine = half * (1 + towards) / std::sqrt(1 + east * east + north * north);
    return static_cast<int>(std::lround(1 + 254 * std::max(0.0, cosine)));
  };
  for (const auto& [east, north] : {std::pair{0.0, 0.0}, {0.5, 0.0}, {0.0, 0.5}, {0.25, -0.75}}) {
    const cv::Mat1b shades = ShadesOfPlane(east, north);
    EXPECT_EQ(cv::countNonZero(shades != expected(east, north)), 0) << east << " " << north;
  }
  EXPECT_EQ(ShadesOfPlane(0, 0)(2, 2), kLevel);
}

TEST(Hillshade, ASlopeAwayFromTheLightIsBlackButNoHole) {
  EXPECT_EQ(ShadesOfPlane(-2, 2)(2, 2), 1);
  EXPECT_GE(ShadesOfPlane(0.7, -0.7)(2, 2), 254) << "rises by 45 degrees to the south-east";
}

TEST(Hillshade, AStepIsSeenFromBothOfItsCells) {
  cv::Mat1f height(5, 6, 0.0f);
  height.colRange(3, 6).setTo(1);
  const cv::Mat1b shades = Hillshade(height, 1);
  // Horn: half a unit a unit in the two columns beside the step.
  const int bright = static_cast<int>(
      std::lround(1 + 254 * std::sqrt(0.5) * (1 + std::sqrt(0.5) / 2) / std::sqrt(1.25)));
  for (int column = 0; column < height.cols; ++column) {
    EXPECT_EQ(shades(2, column), column == 2 || column == 3 ? bright : kLevel) << column;
  }
}

TEST(Hillshade, AHoleIsZeroAndDoesNotBendItsBorder) {
  cv::Mat1f height(5, 5, 7.0f);
  height(2, 2) = std::numeric_limits<float>::quiet_NaN();
  const cv::Mat1b shades = Hillshade(height, 1);
  EXPECT_EQ(shades(2, 2), 0);
  EXPECT_EQ(cv::countNonZero(shades == kLevel), 24);
}

TEST(Hillshade, OneCellIsLevel) { EXPECT_EQ(Hillshade(cv::Mat1f(1, 1, 3.0f), 1)(0, 0), kLevel); }

}  // namespace
}  // namespace skein::depth_test
