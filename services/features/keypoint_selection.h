#pragma once

#include <opencv2/core.hpp>
#include <vector>

namespace skein {

// Indices of at most `max_features` keypoints to keep, by falling contrast (KeyPoint::response).
// The strongest of the whole image take nine tenths of the budget. The rest goes to the cells of a
// grid in rounds, the strongest left in each cell. So weakly textured regions keep keypoints. Ties
// are broken by position, so the result is independent of the input's order.
std::vector<int> SelectKeypoints(const std::vector<cv::KeyPoint>& keypoints, cv::Size image_size,
                                 int max_features);

}  // namespace skein
