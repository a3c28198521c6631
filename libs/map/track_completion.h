#pragma once

#include "map/scene_map.h"

namespace skein {

// After a new photo's local BA: merges tracks that verified matches join, extends them by the
// observations that matches lead to, and makes points of what the photo has left over, all by the
// limits of COLMAP's IncrementalTriangulator (3.8). The points that were modified since
// ClearModifiedPoints3D are looked at: around all their observations, as COLMAP does, or, if they
// are firm, around the new photo's only, since the matches of the others were followed when these
// were new. So a photo's part does not cost more the more others see the same; what that leaves out
// comes with the next global BA. Points that change count as modified.
void CompleteLocally(const colmap::IncrementalTriangulator::Options& options, ImageId new_image,
                     SceneMap* map);

}  // namespace skein
