#pragma once

#include <memory>
#include <opencv2/core.hpp>
#include <string>

#include "features/sift_kernels.h"
#include "formats/formats.h"

namespace skein {

struct SiftOptions {
  std::string method = "skein";  // or "opencv"
  int max_image_px = 1600;       // longest side searched; larger photos are shrunk by area
  int max_features = 8192;
  InstructionSet kernel = FastestInstructionSet();  // of Skein's
};

struct LocalFeatures {
  Keypoints keypoints;      // pixels of the photo in full resolution, centres at 0.5
  Descriptors descriptors;  // RootSIFT; row i describes keypoint i
};

// SIFT (Lowe 2004) by Skein's code or OpenCV's, RootSIFT (Arandjelovic and Zisserman 2012) as
// uint8. Keeps its memory from photo to photo (own_sift.h). Used by one thread; OpenCV's functions
// run on up to `threads` threads (cv::setNumThreads). The result is independent of their number.
class SiftExtractor {
 public:
  // Throws std::invalid_argument if this processor does not run options.kernel.
  explicit SiftExtractor(const SiftOptions& options);
  ~SiftExtractor();

  // `photo` is 8-bit BGR with its pixels as stored, both sides divided by `reduction`. A photo
  // without texture has no keypoints.
  LocalFeatures Extract(const cv::Mat& photo, int threads = 1, int reduction = 1);

  const SiftOptions& options() const { return options_; }

 private:
  const SiftOptions options_;
  std::unique_ptr<class OwnSift> own_;  // null: OpenCV's
};

// Extracts the features of a single photo.
LocalFeatures ExtractSift(const cv::Mat& photo, const SiftOptions& options);

// N x 128 float SIFT of OpenCV -> RootSIFT as uint8, quantised like COLMAP's:
// min(255, round(512 sqrt(value / sum of the row))). A row of zeros stays zero.
Descriptors RootSift(const cv::Mat& sift);

// One row: `sift` and `out` have 128 values; `sum` is the sum of `sift`.
void RootSift(const float* sift, float sum, uint8_t* out);

}  // namespace skein
