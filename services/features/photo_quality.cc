#include "features/photo_quality.h"

#include <algorithm>
#include <bitset>
#include <opencv2/imgproc.hpp>

#include "features/photo_texture.h"
#include "photo/image_view.h"

namespace skein {
namespace {

constexpr int kLongestSidePx = 400;  // the noise of a sensor is averaged out
constexpr int kBlurPx = 9;           // of the second blur, as in the paper
constexpr float kNoise = 3.F / 255;  // less change than this is noise, not an edge
constexpr int kFields = 8;

cv::Mat1f SmallGrey(const cv::Mat& bgr) {
  cv::Mat grey;
  cv::cvtColor(ShrinkTo(bgr, kLongestSidePx), grey, cv::COLOR_BGR2GRAY);
  cv::Mat1f values;
  grey.convertTo(values, CV_32F, 1.0 / 255);
  return values;
}

// Along the axis that `step` tells: the share of change that stays when it is blurred.
float BlurAlong(const cv::Mat1f& grey, cv::Size step) {
  const cv::Size kernel(step.width * (kBlurPx - 1) + 1, step.height * (kBlurPx - 1) + 1);
  if (grey.cols <= kernel.width || grey.rows <= kernel.height) return 0;
  cv::Mat1f blurred;
  cv::blur(grey, blurred, kernel);
  const cv::Rect first({0, 0}, grey.size() - step), second({step.width, step.height}, first.size());
  const cv::Mat change = cv::abs(grey(second) - grey(first));
  const cv::Mat change_left = cv::abs(blurred(second) - blurred(first));
  const cv::Mat is_edge = change > kNoise;
  cv::Mat lost = change - change_left;
  cv::max(lost, 0, lost);
  const double whole = cv::mean(change, is_edge)[0];
  return whole > 0 ? static_cast<float>(1 - cv::mean(lost, is_edge)[0] / whole) : 0;
}

float Coverage(cv::Size size, const std::vector<Keypoint>& keypoints) {
  const auto field = [](float at, int length) {
    return std::clamp(static_cast<int>(at * kFields / static_cast<float>(length)), 0, kFields - 1);
  };
  std::bitset<kFields * kFields> covered;
  for (const Keypoint& keypoint : keypoints) {
    covered.set(field(keypoint.y, size.height) * kFields + field(keypoint.x, size.width));
  }
  return static_cast<float>(covered.count()) / covered.size();
}

}  // namespace

PhotoQuality MeasureQuality(const cv::Mat& bgr, const std::vector<Keypoint>& keypoints,
                            int reduction) {
  const cv::Mat1f grey = SmallGrey(bgr);
  PhotoQuality quality;
  quality.blur = std::max(BlurAlong(grey, {1, 0}), BlurAlong(grey, {0, 1}));
  quality.brightness = static_cast<float>(cv::mean(grey)[0]);
  quality.coverage = Coverage(bgr.size() * reduction, keypoints);
  quality.texture = FindTexture(bgr);
  return quality;
}

}  // namespace skein
