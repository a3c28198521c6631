#pragma once

#include "bundle/bundle.h"
#include "map/scene_map.h"

namespace skein {

// Photos of one agent, size and EXIF count as of one camera. The grouping is a guess: such photos
// may have been zoomed, cropped, or taken by several phones. If so, one focal length for all bends
// the map and still fits it well. So a part of the map (BuildBundleOfSome) is adjusted with
// intrinsics of each photo's own. r: the part of the camera's squared errors that these leave, s:
// the standard deviation of ln f over its photos. If (1 - r) s > 0.02, its photos get them
// (SceneMap::GiveOwnCamera), and the map is adjusted with them. Maps of fewer than three photos,
// and fixed intrinsics, stay as they are. True if photos got any. The fit must converge
// (docs/experiments/own_cameras.md).
bool GiveOwnCameras(BundleOptions options, SceneMap* map);

// The reverse, for photos that got their own intrinsics from a map that was not settled yet, or was
// wrong. If a photo's ln f differs by 0.1 or less from that of the camera that it came with, it has
// this one again (SceneMap::RemoveOwnCamera). A camera that no photo has gets the intrinsics of the
// one in the middle by ln f, if no photo differs more from it. The map is adjusted. True if any
// photo shares its camera again.
bool ShareCamerasAgain(BundleOptions options, SceneMap* map);

}  // namespace skein
