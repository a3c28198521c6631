#include "export/overviews.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace skein {
namespace {

bool IsKnown(const cv::Vec<float, 1>& height) { return !std::isnan(height[0]); }
bool IsKnown(const cv::Vec<uint8_t, 1>& shade) { return shade[0] > 0; }
bool IsKnown(const cv::Vec4b& colour) { return colour[3] > 0; }

// Over the cells of a square of two by two whose upper left cell is (top, left).
template <typename T, int n>
cv::Vec<T, n> MeanOfKnown(const cv::Mat_<cv::Vec<T, n>>& pixels, int top, int left) {
  cv::Vec<float, n> sum;
  int count = 0;
  for (int row = top; row < std::min(top + 2, pixels.rows); ++row) {
    for (int column = left; column < std::min(left + 2, pixels.cols); ++column) {
      if (!IsKnown(pixels(row, column))) continue;
      sum += cv::Vec<float, n>(pixels(row, column));
      ++count;
    }
  }
  if (count == 0) return pixels(top, left);
  return sum * (1.0f / static_cast<float>(count));
}

template <typename Pixel>
cv::Mat HalfOf(const cv::Mat_<Pixel>& pixels) {
  cv::Mat_<Pixel> half((pixels.rows + 1) / 2, (pixels.cols + 1) / 2);
  for (int row = 0; row < half.rows; ++row) {
    for (int column = 0; column < half.cols; ++column) {
      half(row, column) = MeanOfKnown(pixels, 2 * row, 2 * column);
    }
  }
  return half;
}

cv::Mat HalfOfAny(const cv::Mat& pixels) {
  if (pixels.type() == CV_8UC4) return HalfOf(cv::Mat_<cv::Vec4b>(pixels));
  if (pixels.type() == CV_8UC1) return HalfOf(cv::Mat_<cv::Vec<uint8_t, 1>>(pixels));
  return HalfOf(cv::Mat_<cv::Vec<float, 1>>(pixels));
}

}  // namespace

std::vector<cv::Mat> WithOverviews(const cv::Mat& pixels, int side) {
  std::vector<cv::Mat> levels = {pixels};
  while (std::max(levels.back().cols, levels.back().rows) > side) {
    levels.push_back(HalfOfAny(levels.back()));
  }
  return levels;
}

}  // namespace skein
