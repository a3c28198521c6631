#pragma once

#include "features/sift.h"

namespace skein {

// OpenCV's SIFT of an 8-bit grey photo, RootSIFT. Keypoints are in its pixels, without colour.
LocalFeatures OpenCvSift(const cv::Mat& grey, const SiftOptions& options);

}  // namespace skein
