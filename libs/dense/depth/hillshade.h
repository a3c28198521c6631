// Shading of heights, which makes relief visible.
#pragma once

#include <opencv2/core.hpp>

namespace skein {

// Light from the north-west, 45 degrees high, on slopes by Horn (1981), as GDAL's `gdaldem
// hillshade` has it: 1 + 254 max(0, cosine of the angle between normal and light); level ground is
// 181. A hole (NaN) has 0. `height`: rows from north to south. `cell`: side of a cell, in the unit
// of the heights. A neighbour that is a hole or outside continues the slope from the opposite
// neighbour, so a plane has one shade up to its border; without an opposite neighbour the axis
// counts as level.
cv::Mat1b Hillshade(const cv::Mat1f& height, double cell);

}  // namespace skein
