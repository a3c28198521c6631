// Verified pairs of registered photos whose matches are of similar structures, as of two gables of
// one house: they contradict a map that is right.
#pragma once

#include <utility>
#include <vector>

#include "map/scene_map.h"
#include "mapping/registration.h"

namespace skein {

// Whether these pairs together are of similar structures. The first photo of each pair is placed at
// the pose by its matches with the second photo, and the two are compared
// (disambiguation/similar_structures.h). Costs a pose estimation a pair.
bool AreOfSimilarStructures(const SceneMap& map,
                            const std::vector<std::pair<ImageId, ImageId>>& pairs, int min_cells);

}  // namespace skein
