// Depths that featureless areas have from the edges beside them.
#pragma once

#include <opencv2/core.hpp>

#include "depth/depth_map.h"

namespace skein {

// A pixel is bare if its grey differs by at most kBareRange within 3 x 3 pixels. Matching costs are
// equal at all depths there, so a path (depth_sweep.h) brings the depth of an edge into the sky
// beside it, in all photos alike. Makes holes of the depths of each connected bare area that has
// depths in less than half of its pixels. `grey`: of the map's size.
constexpr int kBareRange = 2;  // grey levels
void RemoveDepthsOfBareAreas(const cv::Mat1b& grey, DepthMap* map);

}  // namespace skein
