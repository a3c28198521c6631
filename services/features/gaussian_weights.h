#pragma once

#include <array>
#include <vector>

#include "features/sift_kernels.h"

namespace skein {

// Weights of a Gaussian blur: 2 * radius + 1 values of sum 1 whose variance is sigma^2 to 1e-6,
// cut off at 3 sigma. Blurs of several levels then add up as those of whole Gaussians.
std::vector<float> GaussianWeights(double sigma);

// Weights of one blur for the doubled image, taken of the input's pixels. Doubling interpolates
// linearly: output pixel 2i is input pixel i, 2i + 1 lies half way to i + 1.
struct DoublingWeights {
  int radius = 0;                // inputs i - radius .. i + radius + 1
  std::vector<float> even, odd;  // of output pixels 2i and 2i + 1
};
DoublingWeights BlurOfDoubled(double sigma);

// Blurs of an octave; the same for every octave but for the first level.
struct OctaveBlurs {
  DoublingWeights first;  // of the doubled photo
  std::array<std::vector<float>, kGaussianLevels>
      weights;  // of level i from level i - 1; [0] empty

  explicit OctaveBlurs(double sigma);
  int radius(int level) const { return static_cast<int>(weights[level].size()) / 2; }
};

}  // namespace skein
