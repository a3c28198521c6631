#pragma once

#include "map/scene_map.h"

namespace skein {

// Deregisters the photos that could not have joined one by one. From the two photos with most
// common points, a photo joins that sees limits::kMinPoseInliers points of two photos that joined
// before. The largest part that grows so stays. A photo with less support has a place to which few
// points, or false ones, lead; so has a part of the map that hangs on such photos.
void KeepSupportedPhotos(SceneMap* map);

}  // namespace skein
