#include "features/sift.h"

#include <algorithm>
#include <cmath>
#include <opencv2/features2d.hpp>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "photo/image_view.h"

namespace skein {
namespace {

// OpenCV 4.6 doubles the image by a resize that keeps pixel corners, then maps keypoints back by x
// / 2, as if it had kept pixel centres. They come out 0.25 px too far right and down. With pixel
// centres at 0.5 instead of OpenCV's 0 that leaves +0.25.
constexpr float kPixelCentreMinusUpscaleOffset = 0.5f - 0.25f;

std::vector<cv::KeyPoint> Detect(cv::SIFT& sift, const cv::Mat& grey,
                                 const SelectionOptions& options) {
  std::vector<cv::KeyPoint> all;
  sift.detect(grey, all);
  std::vector<cv::KeyPoint> kept;
  for (const int i : SelectKeypoints(all, grey.size(), options)) kept.push_back(all[i]);
  return kept;
}

Keypoint ToKeypoint(const cv::KeyPoint& found, const cv::Mat& image, double scale_x,
                    double scale_y) {
  const float x = found.pt.x + kPixelCentreMinusUpscaleOffset;
  const float y = found.pt.y + kPixelCentreMinusUpscaleOffset;
  const int column = std::clamp(static_cast<int>(x), 0, image.cols - 1);
  const int row = std::clamp(static_cast<int>(y), 0, image.rows - 1);
  const cv::Vec3b& bgr = image.at<cv::Vec3b>(row, column);
  Keypoint keypoint;
  keypoint.x = static_cast<float>(x * scale_x);
  keypoint.y = static_cast<float>(y * scale_y);
  // OpenCV's size is a diameter.
  keypoint.scale_px = static_cast<float>(found.size / 2 * std::sqrt(scale_x * scale_y));
  keypoint.angle_rad = static_cast<float>(found.angle * CV_PI / 180);
  keypoint.r = bgr[2];
  keypoint.g = bgr[1];
  keypoint.b = bgr[0];
  return keypoint;
}

}  // namespace

Descriptors RootSift(const cv::Mat& sift) {
  Descriptors result;
  result.data.reserve(sift.total());
  for (int i = 0; i < sift.rows; ++i) {
    const float* row = sift.ptr<float>(i);
    float sum = 0;
    for (int d = 0; d < sift.cols; ++d) sum += row[d];
    const float inverse = sum > 0 ? 1 / sum : 0;
    for (int d = 0; d < sift.cols; ++d) {
      const float value = std::round(512 * std::sqrt(row[d] * inverse));
      result.data.push_back(static_cast<uint8_t>(std::min(255.f, value)));
    }
  }
  return result;
}

LocalFeatures ExtractSift(const cv::Mat& photo, const SiftOptions& options) {
  const cv::Mat image = ShrinkTo(photo, options.max_image_px);
  cv::Mat grey;
  cv::cvtColor(image, grey, cv::COLOR_BGR2GRAY);
  const auto sift = cv::SIFT::create(0, options.octave_layers, options.contrast_threshold,
                                     options.edge_threshold, options.sigma);
  std::vector<cv::KeyPoint> found = Detect(*sift, grey, options.selection);
  if (found.empty()) return {};

  cv::Mat descriptors;
  sift->compute(grey, found, descriptors);
  const double scale_x = static_cast<double>(photo.cols) / image.cols;
  const double scale_y = static_cast<double>(photo.rows) / image.rows;
  LocalFeatures features;
  features.keypoints.reserve(found.size());
  for (const auto& k : found) features.keypoints.push_back(ToKeypoint(k, image, scale_x, scale_y));
  features.descriptors = RootSift(descriptors);
  return features;
}

}  // namespace skein
