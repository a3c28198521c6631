#pragma once

#include <opencv2/core.hpp>
#include <vector>

namespace skein {

struct SelectionOptions {
  int max_features = 8192;
  int cell_px = 64;           // side of a grid cell in pixels of the searched image
  double spread = 0.1;        // share of the budget that is dealt evenly to the cells, 0..1
  double scale_exponent = 0;  // strength = contrast * scale^exponent
};

// Indices of the keypoints to keep, strongest first, at most `max_features`. The strongest of the
// whole image take (1 - spread) of the budget; the rest is dealt to the grid's cells in rounds, one
// keypoint each, the strongest left in it, so that weakly textured regions keep theirs.
// Ties are broken by position, so the result doesn't depend on the order of the input.
std::vector<int> SelectKeypoints(const std::vector<cv::KeyPoint>& keypoints, cv::Size image_size,
                                 const SelectionOptions& options);

}  // namespace skein
