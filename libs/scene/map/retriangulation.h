#pragma once

#include <vector>

#include "map/scene_map.h"

namespace skein {

// Continues tracks and triangulates over the matches of under-reconstructed pairs, which drift has
// kept apart (COLMAP's Retriangulate, whose counters need its database). Returns the number of
// added observations.
int Retriangulate(const ImagePairs& pairs, SceneMap* map);

}  // namespace skein
