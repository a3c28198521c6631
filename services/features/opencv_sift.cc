#include "features/opencv_sift.h"

#include <opencv2/features2d.hpp>
#include <vector>

#include "features/keypoint_selection.h"
#include "features/sift_kernels.h"

namespace skein {
namespace {

// OpenCV 4.6 doubles the image by a resize that keeps pixel corners, then maps keypoints back by x
// / 2, as if it had kept pixel centres. They come out 0.25 px too far right and down. With pixel
// centres at 0.5 instead of OpenCV's 0 that leaves +0.25.
constexpr float kPixelCentreMinusUpscaleOffset = 0.5f - 0.25f;

std::vector<cv::KeyPoint> Detect(cv::SIFT& sift, const cv::Mat& grey, int max_features) {
  std::vector<cv::KeyPoint> all;
  sift.detect(grey, all);
  std::vector<cv::KeyPoint> kept;
  for (const int i : SelectKeypoints(all, grey.size(), max_features)) kept.push_back(all[i]);
  return kept;
}

Keypoint ToKeypoint(const cv::KeyPoint& found) {
  Keypoint keypoint;
  keypoint.x = found.pt.x + kPixelCentreMinusUpscaleOffset;
  keypoint.y = found.pt.y + kPixelCentreMinusUpscaleOffset;
  keypoint.scale_px = found.size / 2;  // OpenCV's size is a diameter
  keypoint.angle_rad = static_cast<float>(found.angle * CV_PI / 180);
  return keypoint;
}

}  // namespace

LocalFeatures OpenCvSift(const cv::Mat& grey, const SiftOptions& options) {
  const auto sift =
      cv::SIFT::create(0, kOctaveLayers, kContrastThreshold, kEdgeThreshold, kOctaveSigma);
  std::vector<cv::KeyPoint> found = Detect(*sift, grey, options.max_features);
  if (found.empty()) return {};
  cv::Mat descriptors;
  sift->compute(grey, found, descriptors);
  LocalFeatures features;
  features.keypoints.reserve(found.size());
  for (const auto& k : found) features.keypoints.push_back(ToKeypoint(k));
  features.descriptors = RootSift(descriptors);
  return features;
}

}  // namespace skein
