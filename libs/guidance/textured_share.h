// How much of a surfel has texture in the photos. Inside of libs/guidance.
#pragma once

#include "guidance/guided_map.h"
#include "guidance/surface.h"

namespace skein {

// Of a square of 1.5 cells around the surfel, in the photo in which that is the min_photos-th
// largest, or the least of fewer. A photo whose texture is not known counts as textured. 0 without
// photos.
double TexturedShare(const GuidedMap& map, const Surfel& surfel, double cell, int min_photos);

}  // namespace skein
