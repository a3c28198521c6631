#pragma once

// The scale space of a photo and its extrema (Lowe 2004, sections 3 and 4).
//
// An octave is worked on in tiles, and in a tile row by row: a block of rows goes through all
// blurs, differences and the search while it is in the cache. Each level holds only as many rows as
// later steps need. The three levels in which keypoints lie are kept whole, as 16-bit pixels.

#include <opencv2/core.hpp>
#include <vector>

#include "features/gaussian_weights.h"
#include "features/sift_kernels.h"

namespace skein {

// An extremum of the differences of Gaussians, refined below a pixel.
struct Extremum {
  int octave = 0;      // 0: the doubled photo
  int level = 0;       // the nearest, 1..kOctaveLayers
  float x = 0, y = 0;  // pixels of the octave, pixel centres at integers
  float sigma = 0;     // pixels of the octave
  float contrast = 0;  // |difference of Gaussians|, 0..1
};

// Rows of floats with room for vectors on both sides.
class FloatRows {
 public:
  // Content is kept only if nothing grows.
  void Resize(int width, int rows);
  float* row(int y) { return data_.ptr<float>() + y * stride_ + kRowPadding; }
  const float* row(int y) const { return data_.ptr<float>() + y * stride_ + kRowPadding; }

 private:
  cv::Mat data_;  // aligned for vectors
  size_t stride_ = 0;
};

struct Octave {
  int width = 0, height = 0;
  FloatRows base;                                 // first level; that of octave 0 is not kept
  std::vector<LevelPixel> levels[kOctaveLayers];  // width x height each, row major
};

// Keeps its memory from photo to photo. One thread's.
class ScaleSpace {
 public:
  explicit ScaleSpace(const SiftKernels& kernels);

  // Extrema of an 8-bit grey photo, in no particular order; no two are equal. Runs on up to
  // `threads` of OpenCV's threads; the result is independent of their number. `contrast_threshold`:
  // as kContrastThreshold.
  std::vector<Extremum> Build(const cv::Mat& grey, double contrast_threshold, int threads);

  // The surroundings of `extremum` in the last photo, for orientations and descriptors.
  KeypointPatch Patch(const Extremum& extremum, float angle_rad) const;

 private:
  void BuildOctave(int index, bool is_last, int threads, std::vector<Extremum>* found);

  double contrast_threshold_ = kContrastThreshold;  // of the last Build
  const OctaveBlurs blurs_;
  const SiftKernels& kernels_;
  FloatRows grey_;
  std::vector<Octave> octaves_;
};

}  // namespace skein
