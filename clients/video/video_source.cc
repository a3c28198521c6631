#include "clients/video/video_source.h"

#include <sys/stat.h>

#include <cmath>
#include <utility>

#include "core/clock.h"

namespace skein {
namespace {

bool IsCamera(const std::string& source) { return source.rfind("/dev/", 0) == 0; }

bool IsLive(const std::string& source) {
  return IsCamera(source) || source.find("://") != std::string::npos;
}

int64_t StartOfFile(const std::string& path, const cv::VideoCapture& capture) {
  const double num_frames = capture.get(cv::CAP_PROP_FRAME_COUNT);
  const double rate_hz = capture.get(cv::CAP_PROP_FPS);
  struct stat file {};
  if (!(num_frames > 0) || !(rate_hz > 0) || ::stat(path.c_str(), &file) != 0) return 0;
  const int64_t end_us = int64_t{file.st_mtim.tv_sec} * 1'000'000 + file.st_mtim.tv_nsec / 1000;
  return end_us - std::llround(num_frames / rate_hz * 1e6);
}

}  // namespace

Result<VideoSource> VideoSource::Open(const std::string& source) {
  cv::VideoCapture capture;
  const bool opened = IsCamera(source) ? capture.open(source, cv::CAP_V4L2) : capture.open(source);
  if (!opened || !capture.isOpened()) {
    return Unavailable("cannot open " + source +
                       (IsCamera(source) ? ": is the camera there, and free?"
                        : IsLive(source) ? ": is the address right, and does the stream run?"
                                         : ": is it a video that OpenCV can read?"));
  }
  const bool is_live = IsLive(source);
  // Old frames of a camera are of no use.
  if (is_live) capture.set(cv::CAP_PROP_BUFFERSIZE, 1);
  return VideoSource(std::move(capture), is_live, is_live ? 0 : StartOfFile(source, capture));
}

int64_t VideoSource::NumFrames() const {
  const double num_frames = capture_.get(cv::CAP_PROP_FRAME_COUNT);
  return !is_live_ && num_frames > 0 && num_frames < 1e9 ? std::llround(num_frames) : 0;
}

std::optional<VideoFrame> VideoSource::Next() {
  const double position_ms = capture_.get(cv::CAP_PROP_POS_MSEC);
  VideoFrame frame;
  if (!capture_.read(frame.image) || frame.image.empty()) return std::nullopt;
  frame.index = num_frames_++;
  if (is_live_) frame.utime_us = NowUs();
  if (start_utime_us_ != 0) frame.utime_us = start_utime_us_ + std::llround(position_ms * 1e3);
  return frame;
}

}  // namespace skein
