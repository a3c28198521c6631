#include "clients/video/frame_picker.h"

#include <algorithm>
#include <opencv2/imgproc.hpp>
#include <opencv2/video/tracking.hpp>
#include <utility>

#include "core/option_check.h"
#include "core/statistics.h"

namespace skein {
namespace {

constexpr int kTrackingSizePx = 640;
constexpr int kMaxCorners = 400;
// Fewer say nothing of a view.
constexpr size_t kMinCorners = 20;
constexpr double kMaxRoundTripPx = 1;
constexpr size_t kRecentFrames = 30;

cv::Mat1b SmallGrey(const cv::Mat3b& image) {
  cv::Mat1b grey, small;
  cv::cvtColor(image, grey, cv::COLOR_BGR2GRAY);
  const double scale = static_cast<double>(kTrackingSizePx) / std::max(grey.cols, grey.rows);
  if (scale >= 1) return grey;
  cv::resize(grey, small, {}, scale, scale, cv::INTER_AREA);
  return small;
}

std::vector<cv::Point2f> CornersOf(const cv::Mat1b& grey) {
  std::vector<cv::Point2f> corners;
  cv::goodFeaturesToTrack(grey, corners, kMaxCorners, 0.01, 8);
  return corners;
}

double Sharpness(const cv::Mat3b& image) {
  cv::Mat1b grey;
  cv::Mat1f laplacian;
  cv::cvtColor(image, grey, cv::COLOR_BGR2GRAY);
  cv::Laplacian(grey, laplacian, CV_32F);
  cv::Scalar mean, deviation;
  cv::meanStdDev(laplacian, mean, deviation);
  return deviation[0] * deviation[0];
}

}  // namespace

Status FramePickerOptions::Check() const {
  const Status ranges = FirstError({InRange("min_motion", min_motion, 0.001, 1.0),
                                    InRange("max_motion", max_motion, 0.001, 1.0),
                                    InRange("min_overlap", min_overlap, 0.0, 1.0),
                                    InRange("min_sharpness", min_sharpness, 0.0, 1.0)});
  if (!ranges.ok() || min_motion < max_motion) return ranges;
  return InvalidArgument("min_motion must be below max_motion");
}

void FramePicker::SetReference(const cv::Mat1b& grey) {
  reference_ = grey;
  corners_ = CornersOf(grey);
}

std::optional<double> FramePicker::MotionTo(const cv::Mat1b& grey) const {
  const cv::Size window(21, 21);
  constexpr int kLevels = 4;
  std::vector<cv::Point2f> there, back;
  std::vector<uint8_t> found, found_back;
  cv::calcOpticalFlowPyrLK(reference_, grey, corners_, there, found, cv::noArray(), window,
                           kLevels);
  cv::calcOpticalFlowPyrLK(grey, reference_, there, back, found_back, cv::noArray(), window,
                           kLevels);
  std::vector<double> motions;
  for (size_t i = 0; i < corners_.size(); ++i) {
    const bool tracked =
        found[i] && found_back[i] && cv::norm(back[i] - corners_[i]) <= kMaxRoundTripPx;
    if (tracked) motions.push_back(cv::norm(there[i] - corners_[i]));
  }
  const double overlap = static_cast<double>(motions.size()) / corners_.size();
  if (motions.empty() || overlap < options_.min_overlap) return std::nullopt;
  return UpperMedian(std::move(motions)) / std::max(grey.cols, grey.rows);
}

bool FramePicker::IsBlurred(double sharpness) {
  recent_sharpness_.push_back(sharpness);
  if (recent_sharpness_.size() > kRecentFrames) recent_sharpness_.pop_front();
  const double sharpest = *std::max_element(recent_sharpness_.begin(), recent_sharpness_.end());
  return sharpness < options_.min_sharpness * sharpest;
}

void FramePicker::Consider(const Candidate& candidate) {
  if (!best_ || candidate.sharpness > best_->sharpness) best_ = candidate;
}

// Frames that came after the photo are considered again with the next ones.
std::optional<VideoFrame> FramePicker::Pick(const Candidate& current) {
  if (!best_) best_ = current;
  const Candidate photo = *std::exchange(best_, std::nullopt);
  SetReference(photo.grey);
  has_photo_ = true;
  if (photo.frame.index == current.frame.index) return photo.frame;
  const std::optional<double> motion = MotionTo(current.grey);
  if (!motion || *motion >= options_.min_motion) Consider(current);
  return photo.frame;
}

std::optional<VideoFrame> FramePicker::Add(const VideoFrame& frame) {
  const Candidate current{{frame.image.clone(), frame.index, frame.utime_us},
                          SmallGrey(frame.image),
                          Sharpness(frame.image)};
  if (IsBlurred(current.sharpness)) return std::nullopt;
  if (reference_.empty()) {
    if (CornersOf(current.grey).size() < kMinCorners) return std::nullopt;
    SetReference(current.grey);
    Consider(current);
    return std::nullopt;
  }
  // The first photo is chosen among the frames before the camera has moved.
  const double from = has_photo_ ? options_.min_motion : 0;
  const double to = has_photo_ ? options_.max_motion : options_.min_motion;
  const std::optional<double> motion = MotionTo(current.grey);
  if (motion && *motion < from) return std::nullopt;
  if (motion && *motion <= to) {
    Consider(current);
    return std::nullopt;
  }
  if (!motion && CornersOf(current.grey).size() < kMinCorners) return std::nullopt;
  return Pick(current);
}

std::optional<VideoFrame> FramePicker::Finish() {
  if (!best_) return std::nullopt;
  return std::exchange(best_, std::nullopt)->frame;
}

}  // namespace skein
