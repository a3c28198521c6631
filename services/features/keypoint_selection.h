#pragma once

#include <opencv2/core.hpp>
#include <vector>

namespace skein {

struct SelectionOptions {
  int max_features = 8192;
  int cell_px = 64;     // side of a grid cell in pixels of the searched image
  double spread = 0.1;  // share of the budget that is dealt evenly to the cells, 0..1
};

// Indices of at most `max_features` keypoints to keep, by falling contrast (KeyPoint::response).
// The strongest of the whole image take (1 - spread) of the budget. The rest goes to the cells of a
// grid in rounds, the strongest left in each cell. So weakly textured regions keep keypoints. Ties
// are broken by position, so the result is independent of the input's order.
std::vector<int> SelectKeypoints(const std::vector<cv::KeyPoint>& keypoints, cv::Size image_size,
                                 const SelectionOptions& options);

}  // namespace skein
