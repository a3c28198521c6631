// Smaller copies of a grid, which viewers of far-away extents read.
#pragma once

#include <opencv2/core.hpp>
#include <vector>

namespace skein {

// The grid itself, then each grid halved, until the longer side is at most `side` cells. A cell of
// a half is the mean of its up to four known cells, and a hole without any; odd sides round up.
// `pixels`: CV_8UC4 (a hole has alpha 0), CV_8UC1 (a hole is 0) or CV_32FC1 (a hole is NaN).
std::vector<cv::Mat> WithOverviews(const cv::Mat& pixels, int side);

}  // namespace skein
