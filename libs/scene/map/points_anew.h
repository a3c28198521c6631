#pragma once

#include <functional>

#include "map/scene_map.h"

namespace skein {

// Drops all points and triangulates the matches of the registered photos as they stand, photo by
// photo by name, as COLMAP's point_triangulator does. Tracks that grew with the map depend on the
// poses they were found with. Visits all matches; poses and cameras stay.
//
// Keypoints that no chain of matches joins have no part in each other's points. So the threads
// share out the connected components of keypoints, and the points are those of one thread. Together
// the threads hold one copy of the matched keypoints and of the matches.
//
// `stop`, if not null, is asked by the calling thread before each photo of its own share, and then
// after each photo that another thread has done: once a photo and thread, so it's asked until all
// is done. At true the former points are still there, and the result is false.
bool TriangulateAnew(int num_threads, SceneMap* map, const std::function<bool()>& stop = nullptr);

}  // namespace skein
