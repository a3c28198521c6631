// Picks the frames of a video that become photos: sharp ones, with enough motion between them.
#pragma once

#include <cstdint>
#include <deque>
#include <opencv2/core.hpp>
#include <optional>
#include <vector>

#include "core/result.h"

namespace skein {

struct FramePickerOptions {
  // Motion from photo to photo, as a share of the frame's longest side. The sharpest frame within
  // that range becomes a photo.
  double min_motion = 0.05;
  double max_motion = 0.15;
  // Share of a photo's points that must be found again; below it the view has changed as far as by
  // max_motion.
  double min_overlap = 0.5;
  // A frame with less than this share of the sharpness of the sharpest of the last 30 is blurred by
  // motion, and no photo.
  double min_sharpness = 0.25;

  Status Check() const;
};

struct VideoFrame {
  cv::Mat3b image;       // BGR; shares its pixels
  int64_t index = 0;     // of the video's frames
  int64_t utime_us = 0;  // when it was taken; 0: not known
};

// Motion is the median displacement of points that are tracked from the last photo (Shi-Tomasi
// corners, pyramidal Lucas-Kanade, forward and backward), at a longest side of 640 px. Sharpness is
// the variance of the Laplacian (Pech-Pacheco et al. 2000), which is compared within a few frames
// only, as it hangs on what they show. A camera that stands still gives one photo; a view with
// fewer than 20 corners gives none.
class FramePicker {
 public:
  explicit FramePicker(const FramePickerOptions& options) : options_(options) {}

  // The next frame. Gives the photo that is decided by it, which may be an earlier frame.
  std::optional<VideoFrame> Add(const VideoFrame& frame);
  // No frame follows. Gives the last photo, if there is one more.
  std::optional<VideoFrame> Finish();

 private:
  struct Candidate {
    VideoFrame frame;
    cv::Mat1b grey;  // small
    double sharpness = 0;
  };

  std::optional<VideoFrame> Pick(const Candidate& current);
  void Consider(const Candidate& candidate);
  bool IsBlurred(double sharpness);
  // Motion of the frame since the last photo, as a share of its longest side; nullopt if too little
  // of the photo is found again.
  std::optional<double> MotionTo(const cv::Mat1b& grey) const;
  void SetReference(const cv::Mat1b& grey);

  const FramePickerOptions options_;
  cv::Mat1b reference_;  // of the last photo; of the first frame before there is one
  std::vector<cv::Point2f> corners_;
  bool has_photo_ = false;
  std::deque<double> recent_sharpness_;
  std::optional<Candidate> best_;
};

}  // namespace skein
