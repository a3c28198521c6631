#pragma once

#include <cstddef>
#include <vector>

#include "map/scene_map.h"

namespace skein {

// The registered photos nearest to `centers` along verified pairs, breadth first, at most
// `max_photos`; of the centers, too. `centers`: registered, each once.
std::vector<ImageId> RegisteredAround(const SceneMap& map, std::vector<ImageId> centers,
                                      size_t max_photos);

}  // namespace skein
