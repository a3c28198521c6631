#include "codecs/deep_pixels.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <vector>

namespace skein {
namespace {

constexpr double kShareOutside = 0.001;  // at each end
constexpr int kSamples = 1'000'000;

cv::Mat WithoutAlpha(const cv::Mat& image) {
  if (image.channels() != 4) return image;
  cv::Mat colour;
  cv::cvtColor(image, colour, cv::COLOR_BGRA2BGR);
  return colour;
}

}  // namespace

cv::Vec2d ValueRange(const cv::Mat& image) {
  const cv::Mat colour = WithoutAlpha(image);
  const int row_step = std::max(1, static_cast<int>(colour.total() * colour.channels() / kSamples));
  std::vector<double> values;
  for (int y = 0; y < colour.rows; y += row_step) {
    cv::Mat1d row;
    colour.row(y).reshape(1).convertTo(row, CV_64F);
    std::copy_if(row.begin(), row.end(), std::back_inserter(values),
                 [](double value) { return std::isfinite(value); });
  }
  if (values.empty()) return {0, 0};
  const auto at = [&values](double share) {
    const auto place = values.begin() + std::lround(share * static_cast<double>(values.size() - 1));
    std::nth_element(values.begin(), place, values.end());
    return *place;
  };
  return {at(kShareOutside), at(1 - kShareOutside)};
}

cv::Mat StretchToEightBits(const cv::Mat& deep, const cv::Vec2d& range) {
  const cv::Mat colour = WithoutAlpha(deep);
  const double scale = range[1] > range[0] ? 255 / (range[1] - range[0]) : 0;
  cv::Mat stretched(colour.size(), CV_8UC(colour.channels()));
  for (int y = 0; y < colour.rows; ++y) {
    cv::Mat1d row;
    colour.row(y).reshape(1).convertTo(row, CV_64F);
    uint8_t* out = stretched.ptr<uint8_t>(y);
    for (int x = 0; x < row.cols; ++x) {
      const double value = scale * (row(x) - range[0]);
      out[x] = std::isfinite(value) ? cv::saturate_cast<uint8_t>(value) : uint8_t{0};
    }
  }
  if (stretched.channels() == 1) cv::cvtColor(stretched, stretched, cv::COLOR_GRAY2BGR);
  return stretched;
}

}  // namespace skein
