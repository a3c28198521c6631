#include "features/usual_contrast.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <utility>
#include <vector>

#include "features/sift_kernels.h"

namespace skein {
namespace {

constexpr double kBlurOfPhoto = 0.5;        // as Lowe 2004, section 3.3
constexpr double kFirstSigma = 0.8;         // of the doubled photo 1.6
constexpr double kMedianOfNormal = 0.6745;  // of absolute values, in standard deviations
constexpr int kStep = 2;                    // pixels: neighbours tell the same

float MedianOfAbsolutes(const cv::Mat1f& values) {
  std::vector<float> some;
  for (int y = 0; y < values.rows; y += kStep) {
    for (int x = 0; x < values.cols; x += kStep) some.push_back(std::abs(values(y, x)));
  }
  const auto middle = some.begin() + static_cast<ptrdiff_t>(some.size() / 2);
  std::nth_element(some.begin(), middle, some.end());
  return *middle;
}

}  // namespace

double UsualContrast(const cv::Mat& grey) {
  cv::Mat1f photo;
  grey.convertTo(photo, CV_32F, 1.0 / 255);
  const auto blurred = [&photo](double sigma) {
    cv::Mat1f level;
    cv::GaussianBlur(photo, level, {}, std::sqrt(sigma * sigma - kBlurOfPhoto * kBlurOfPhoto));
    return level;
  };
  float most = 0;
  cv::Mat1f level = blurred(kFirstSigma);
  for (int i = 1; i <= 2 * kOctaveLayers; ++i) {
    cv::Mat1f next = blurred(kFirstSigma * std::exp2(static_cast<double>(i) / kOctaveLayers));
    most = std::max(most, MedianOfAbsolutes(next - level));
    level = std::move(next);
  }
  return kOctaveLayers * most / kMedianOfNormal;
}

}  // namespace skein
