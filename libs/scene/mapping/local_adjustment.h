#pragma once

#include "map/bundle_builder.h"
#include "map/scene_map.h"

namespace skein {

// The part of a map that a new photo's local BA refines, as COLMAP selects it
// (incremental_mapper.cc, bundle_adjustment.cc of COLMAP 3.8). The window is the new image and
// those with most points in common with it, `num_images` in all; COLMAP takes six. Two of them are
// held for the gauge. The new image's points are refined with all their observations, but for long
// tracks. Other points are constant when images outside observe them.
BundleRequest SelectLocalWindow(const SceneMap& map, ImageId new_image, int num_images);

}  // namespace skein
