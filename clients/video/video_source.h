// The frames of a video: a file, a numbered series of images, a stream, or a camera.
#pragma once

#include <cstdint>
#include <opencv2/videoio.hpp>
#include <optional>
#include <string>

#include "clients/video/frame_picker.h"
#include "core/result.h"

namespace skein {

// Read by OpenCV's VideoCapture. A source with "://" in it is a stream, /dev/... is a camera: both
// are live. One thread at a time.
class VideoSource {
 public:
  // An error, which says what to check, if it cannot be opened.
  static Result<VideoSource> Open(const std::string& source);

  bool is_live() const { return is_live_; }
  // Number of frames of a file, as it says itself; 0: not known.
  int64_t NumFrames() const;

  // The next frame; nothing at the end of a file, or when a live source failed. utime_us of a live
  // frame is the clock when it came. For a file it is the time of its last write, when the
  // recording ended, less the duration of what follows the frame; 0 if the length is not known.
  std::optional<VideoFrame> Next();

 private:
  VideoSource(cv::VideoCapture capture, bool is_live, int64_t start_utime_us)
      : capture_(std::move(capture)), is_live_(is_live), start_utime_us_(start_utime_us) {}

  cv::VideoCapture capture_;
  bool is_live_;
  int64_t start_utime_us_;  // of a file; 0: not known
  int64_t num_frames_ = 0;
};

}  // namespace skein
