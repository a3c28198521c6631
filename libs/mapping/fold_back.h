#pragma once

#include <vector>

#include "map/scene_map.h"
#include "mapping/background_ba.h"

namespace skein {

// Puts a bundle that was refined on a copy back into the map, which has grown meanwhile. What the
// bundle holds takes its values. A photo registered since then keeps its place with respect to the
// photo of the bundle with which it shares most points (its anchor), and a new point with respect
// to the first photo of its track that has one: they follow the anchor's local similarity, of which
// the scale is the median change of its points' depths. Photos and points that are gone are passed
// over. Returns the photos that are new, for a bundle adjustment of their own. Visits all points
// once, without projecting them.
std::vector<ImageId> FoldBack(const RefinedBundle& bundles, SceneMap* map);

}  // namespace skein
