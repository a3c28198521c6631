#include "features/sift.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "features/opencv_sift.h"
#include "features/own_sift.h"
#include "photo/image_view.h"

namespace skein {
namespace {

// From pixels of the searched image, `image`, to those of the photo.
void FinishKeypoint(const cv::Mat& image, double scale_x, double scale_y, Keypoint* keypoint) {
  const int column = std::clamp(static_cast<int>(keypoint->x), 0, image.cols - 1);
  const int row = std::clamp(static_cast<int>(keypoint->y), 0, image.rows - 1);
  const cv::Vec3b& bgr = image.at<cv::Vec3b>(row, column);
  keypoint->x = static_cast<float>(keypoint->x * scale_x);
  keypoint->y = static_cast<float>(keypoint->y * scale_y);
  keypoint->scale_px = static_cast<float>(keypoint->scale_px * std::sqrt(scale_x * scale_y));
  keypoint->r = bgr[2];
  keypoint->g = bgr[1];
  keypoint->b = bgr[0];
}

}  // namespace

void RootSift(const float* sift, float sum, uint8_t* out) {
  const float inverse = sum > 0 ? 1 / sum : 0;
  for (size_t d = 0; d < Descriptors::kDim; ++d) {
    const float value = kDescriptorNorm * std::sqrt(sift[d] * inverse) + 0.5f;
    out[d] = static_cast<uint8_t>(std::min(255.f, value));
  }
}

Descriptors RootSift(const cv::Mat& sift) {
  Descriptors result;
  result.data.resize(sift.total());
  for (int i = 0; i < sift.rows; ++i) {
    const float* row = sift.ptr<float>(i);
    float sum = 0;
    for (int d = 0; d < sift.cols; ++d) sum += row[d];
    RootSift(row, sum, result.data.data() + i * Descriptors::kDim);
  }
  return result;
}

SiftExtractor::SiftExtractor(const SiftOptions& options) : options_(options) {
  if (options.method == "skein") own_ = std::make_unique<OwnSift>(options);
}

SiftExtractor::~SiftExtractor() = default;

LocalFeatures SiftExtractor::Extract(const cv::Mat& photo, int threads, int reduction) {
  const cv::Mat image = ShrinkTo(photo, options_.max_image_px);
  cv::Mat grey;
  cv::cvtColor(image, grey, cv::COLOR_BGR2GRAY);
  LocalFeatures features = own_ ? own_->Extract(grey, threads) : OpenCvSift(grey, options_);
  const double scale_x = static_cast<double>(reduction) * photo.cols / image.cols;
  const double scale_y = static_cast<double>(reduction) * photo.rows / image.rows;
  for (Keypoint& k : features.keypoints) FinishKeypoint(image, scale_x, scale_y, &k);
  return features;
}

LocalFeatures ExtractSift(const cv::Mat& photo, const SiftOptions& options) {
  return SiftExtractor(options).Extract(photo);
}

}  // namespace skein
