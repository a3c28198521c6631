#pragma once

#include <opencv2/core.hpp>

#include "features/keypoint_selection.h"
#include "formats/formats.h"

namespace skein {

struct SiftOptions {
  int max_image_px = 1600;           // longest side searched; larger photos are shrunk by area
  double contrast_threshold = 0.02;  // as COLMAP's peak threshold 0.02 / octave_layers
  double edge_threshold = 10;
  int octave_layers = 3;
  double sigma = 1.6;
  SelectionOptions selection;
};

struct LocalFeatures {
  Keypoints keypoints;      // full-resolution pixels of `photo`, pixel centres at 0.5
  Descriptors descriptors;  // RootSIFT; row i describes keypoint i
};

// SIFT (Lowe 2004) with OpenCV's detector, RootSIFT (Arandjelovic and Zisserman 2012) as uint8.
// `photo` is 8-bit BGR with its pixels as stored. A photo without texture has no keypoints.
// Deterministic; runs on OpenCV's threads (cv::setNumThreads).
LocalFeatures ExtractSift(const cv::Mat& photo, const SiftOptions& options);

// Rows of OpenCV's float SIFT -> L1-normalised, square root, times 512, rounded, at most 255: the
// quantisation of COLMAP.
Descriptors RootSift(const cv::Mat& sift);

}  // namespace skein
