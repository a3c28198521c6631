#pragma once

#include <array>
#include <opencv2/core.hpp>
#include <vector>

#include "features/scale_space.h"

namespace skein {

// A rectangle of an octave, from its first level to its extrema. Rows are asked for from behind:
// the search of a row asks the last level for its rows, that asks the level before, and so on.
class OctaveTile {
 public:
  // `grey`: the photo, for octave 0; else null, and the octave has its base.
  OctaveTile(double contrast_threshold, const OctaveBlurs& blurs, const SiftKernels& kernels,
             const FloatRows* grey, int octave_index, const cv::Rect& area, Octave* octave,
             FloatRows* next_base);

  // Fills `area` of the octave's levels and of the next octave's base.
  std::vector<Extremum> Run();

 private:
  // Rows of a level or of a difference, those of the last that were made.
  struct Ring {
    FloatRows rows;
    int capacity = 0;
    int end = 0;   // one behind the last row that the tile needs of it
    int done = 0;  // one behind the last row made
  };

  const float* LevelRow(int level, int y) const;
  float* RingRow(Ring* ring, int y, int block_row);
  void MakeRows(int level, int end);
  void DoubleBlock(int y);
  void BlurBlock(int level, int y);
  void KeepRow(int level, int y);
  void SearchRow(int y, std::vector<Extremum>* found);

  const double contrast_threshold_;
  const OctaveBlurs& blurs_;
  const SiftKernels& kernels_;
  const FloatRows* grey_;
  const int octave_index_;
  const cv::Rect area_;  // pixels of the octave
  Octave* const octave_;
  FloatRows* const next_base_;  // null: there is none
  int left_, width_;  // columns that are worked on: `area_` and what blurs spoil around it
  std::array<Ring, kGaussianLevels> levels_;
  std::array<FloatRows, kDogLevels> differences_;
  std::array<int, kDogLevels> difference_capacity_;
  FloatRows spare_;  // where rows behind the last one go
  std::vector<float> scratch_;
  std::vector<FoundExtremum> found_;
};

}  // namespace skein
