// The frames of a video: a file, a numbered series of images, a stream, or a camera.
#pragma once

#include <cstdint>
#include <opencv2/videoio.hpp>
#include <optional>
#include <string>

#include "clients/video/frame_picker.h"
#include "core/result.h"

namespace skein {

// Reads a video by OpenCV's VideoCapture. A source with "://" in it is a stream, /dev/... is a
// camera: both are live. Not thread-safe.
class VideoSource {
 public:
  // Error: the source cannot be opened; the text says what to check.
  static Result<VideoSource> Open(const std::string& source);

  bool is_live() const { return is_live_; }
  // Number of frames by the header of the file; 0: not known.
  int64_t NumFrames() const;

  // Next frame; nullopt at the end of a file or after an error of a live source. utime_us of a live
  // frame: time of its arrival. utime_us of a frame of a file: (last write of the file, taken as
  // the end of the recording) - (duration from the frame to the end); 0 if the length is not known.
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
