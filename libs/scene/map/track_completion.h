#pragma once

#include <vector>

#include "map/scene_map.h"

namespace skein {

// Continues tracks after a new photo's local BA, within the limits of COLMAP's
// IncrementalTriangulator (3.8):
//  - merges tracks that a verified match joins;
//  - adds the observations that matches lead to;
//  - triangulates the photo's remaining matches.
// Points modified since ClearModifiedPoints3D are visited. For a short track the matches of all its
// observations are followed, as in COLMAP. For a long track (scene_map.h) only the new photo's
// matches are followed: those of the others were followed when these were new. Cost per photo is
// independent of track length. The next global BA completes the rest. Points that change count as
// modified.
void CompleteLocally(ImageId new_image, SceneMap* map);

// Completes the tracks of points, then merges those of one point, as COLMAP's CompleteTracks and
// MergeTracks do; if two points are one, the smaller id suffices. Threads look for what gains,
// which few points do once a map is complete. The points that gain are then changed one after
// another. The result is that of one thread. Returns the number of observations added or merged.
size_t GrowTracks(int num_threads, const std::vector<Point3DId>& points, SceneMap* map);

}  // namespace skein
