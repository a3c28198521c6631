// All photos of a map at once, from the rotations and directions of their pairs.
#pragma once

#include <set>

#include "map/scene_map.h"
#include "mapping/submap_options.h"

namespace skein {

// Drops poses and points. Cameras of registered photos keep their intrinsics. If a camera's
// registered photos have intrinsics of their own, its other photos get some, too.
void ClearButIntrinsics(SceneMap* map);

// Places the photos that have verified pairs globally: rotation averaging of their relative
// rotations, positions from the directions to common points (global_positions.h), triangulation,
// bundle adjustment (as GLOMAP; Pan et al., ECCV 2024). `map`: of these photos none is registered;
// cameras have the intrinsics to start from. On return those that could be placed are registered;
// none where there are too few. Photos of `without` are passed over.
// Relative rotations depend on the intrinsics. So it begins once more while with those it found
// more of the pairs fit each other.
void MapGlobally(const SubmapOptions& options, const std::set<ImageId>& without, SceneMap* map);

}  // namespace skein
