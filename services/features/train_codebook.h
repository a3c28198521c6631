#pragma once

#include <cstdint>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "features/sift.h"
#include "vocabulary/codebook.h"

namespace skein {

struct TrainingOptions {
  int local_dim = 64;
  int num_cells = 64;
  int cell_dim = 16;
  uint64_t seed = 1;
};

// Learns PCA of RootSIFT, k-means cells and each cell's principal axes from the local descriptors,
// and the mean vector of the photos. Deterministic by the seed. Throws std::invalid_argument with
// fewer descriptors than 10 * num_cells, or unless 128 >= local_dim >= cell_dim >= 1.
Codebook TrainCodebook(const std::vector<LocalFeatures>& photos, const std::string& id,
                       const TrainingOptions& options);

// `photo` under a random similarity (rotated up to 25 degrees, shrunk down to 0.5), a change of
// perspective, contrast and brightness, blur and noise. Deterministic by `seed`.
cv::Mat AugmentPhoto(const cv::Mat& photo, uint64_t seed);

}  // namespace skein
