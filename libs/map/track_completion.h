#pragma once

#include "map/scene_map.h"

namespace skein {

// Continues tracks after a new photo's local BA, within the limits of COLMAP's
// IncrementalTriangulator (3.8):
//  - merges tracks that a verified match joins;
//  - adds the observations that matches lead to;
//  - triangulates the photo's remaining matches.
// Points modified since ClearModifiedPoints3D are visited. Of a point with a short track all
// observations' matches are followed, as in COLMAP. Of a long track (scene_map.h) the new
// photo's matches are followed: those of the others were followed when these were new. Cost per
// photo is independent of track length. The next global BA completes the rest. Points that change
// count as modified.
void CompleteLocally(const colmap::IncrementalTriangulator::Options& options, ImageId new_image,
                     SceneMap* map);

// The same of all points that several registered photos see: COLMAP's CompleteAllTracks and
// MergeAllTracks. Threads look for the points that gain, which few do once a map is complete;
// these alone are changed then, one after another. The result is that of one thread. Returns the
// number of observations added or merged.
size_t GrowAllTracks(const colmap::IncrementalTriangulator::Options& options, int num_threads,
                     SceneMap* map);

}  // namespace skein
