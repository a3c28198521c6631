#pragma once

#include <vector>

#include "bundle/bundle.h"
#include "map/scene_map.h"

namespace skein {

// Folds a bundle that was refined on a copy back into the map, which has grown meanwhile. Contents
// of the bundle take their refined values.
//  - A photo registered since then, or constant in it, follows its anchor: the photo of the bundle
//    with most points in common.
//  - A new point follows the first photo of its track that has an anchor.
// Following applies the anchor's local similarity. Its scale is the median change of the depths of
// the anchor's points. Photos and points that are gone are skipped. Returns the new photos, for a
// bundle adjustment of their own. Visits all points once, without projecting them.
std::vector<ImageId> FoldBack(const Bundle& refined, SceneMap* map);

}  // namespace skein
