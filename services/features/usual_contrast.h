#pragma once

#include <opencv2/core.hpp>

namespace skein {

// The contrast that most of a photo has, whatever its scale: the greatest standard deviation of a
// difference of Gaussians in the two finest octaves, by the median of its absolute values, times
// the number of layers, 0..1 as kContrastThreshold. UsualContrast scales with the
// photo's contrast. The scene exceeds it many times over in places; noise exceeds it by a factor of
// 5 nowhere.
double UsualContrast(const cv::Mat& grey);

}  // namespace skein
