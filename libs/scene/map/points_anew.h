#pragma once

#include <functional>

#include "map/scene_map.h"

namespace skein {

// Drops all points and triangulates the matches of the registered photos as they stand, photo by
// photo by name, as COLMAP's point_triangulator does. Tracks that grew with the map depend on the
// poses they were found with. Visits all matches; poses and cameras stay.
//
// Keypoints that no chain of matches joins have no part in each other's points. So the connected
// components of keypoints are divided into four parts, which the threads share out. Points and ids
// do not depend on the number of threads; more than four are not used. Together the parts hold one
// copy of the matched keypoints and of the matches.
//
// `stop`, if not null, is asked by the calling thread before each photo of its own parts, and then
// after each photo that another thread has done: once a photo and part, so until all is done. At
// true the former points are still there, and the result is false.
bool TriangulateAnew(int num_threads, SceneMap* map, const std::function<bool()>& stop = nullptr);
// The matches of some of the map's pairs alone.
bool TriangulateAnew(int num_threads, const ImagePairs& pairs, SceneMap* map,
                     const std::function<bool()>& stop = nullptr);

}  // namespace skein
