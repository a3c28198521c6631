#pragma once

#include "bundle/bundle.h"
#include "map/scene_map.h"

namespace skein {

// Photos of one agent, size and EXIF count as of one camera. The grouping is a guess: such photos
// may have been zoomed, cropped, or taken by several phones. If so, one focal length for all bends
// the map and still fits it well. So both hypotheses are adjusted, from the map as it is, by a part
// of it (BuildBundleOfSome). If own intrinsics leave less than half of the camera's sum of
// squared errors, its photos get them (SceneMap::GiveOwnCamera), and the map is adjusted with them.
// Photos of one camera leave 0.69 or more, zoomed ones 0.01 to 0.47, but two captures at VGA size:
// temple-ring's first 24 left 0.65, all of rgbd-scene 0.84. Cropped photos among others leave up
// to 0.57: if they leave less than 0.75, and the own focal lengths are of two groups
// (two_groups.h), the photos get them as well. Maps of fewer than three photos, and fixed
// intrinsics, stay as they are. True if photos got any. The fit must converge: after ten iterations
// from a bent map zoomed photos left 0.75, after thirty 0.42.
bool GiveOwnCameras(BundleOptions options, SceneMap* map);

// The reverse, for photos that got their own intrinsics when they were registered, by a map whose
// intrinsics were not settled yet. Both hypotheses are adjusted for each such photo alone, with its
// points. If its own intrinsics do not leave less than half of its sum of squared errors with the
// intrinsics of the photos that it came with, it has theirs again (SceneMap::RemoveOwnCamera), and
// the map is adjusted with them. True if any has.
bool ShareCamerasAgain(BundleOptions options, SceneMap* map);

}  // namespace skein
