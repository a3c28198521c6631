// Shared images that came from the mappers (map/shared_images.h), as EstimateSim3 takes them.
#pragma once

#include <vector>

#include "formats/formats.h"
#include "geometry/sim3_ransac.h"

namespace skein {

// Images of an unknown camera model or with wrong parameters are left
// out: the blob came over the network.
std::vector<SharedView> ViewsOf(const SharedImages& images);

}  // namespace skein
