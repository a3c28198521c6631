#pragma once

#include <opencv2/core.hpp>

namespace skein {

// Least and greatest value of all channels, without the thousandth at each end, where dead pixels
// lie. Values that are not finite do not count. {0, 0} if there are no others.
cv::Vec2d ValueRange(const cv::Mat& image);

// Grey, BGR or BGRA of any depth -> 8-bit BGR. `range` becomes 0 to 255, what lies outside is cut;
// one map for all channels. All is 0 if the range is a point, and values that are not finite are.
cv::Mat StretchToEightBits(const cv::Mat& deep, const cv::Vec2d& range);

}  // namespace skein
