// Photos of a merged model, by the one of its two models that they belong to.
#pragma once

#include <set>

#include "map/scene_map.h"

namespace skein {

struct DividedPhotos {
  std::set<ImageId> of_first, of_second;
};

// `first`, `second`: the photos of the two. A photo of both belongs to that with more of its
// verified matches: in the wrong map, by an object that two places have in common, it has few.
// `map` has the verified pairs of all photos. Costs the pairs of the merged model's photos.
DividedPhotos DividePhotos(const SceneMap& map, const std::set<ImageId>& first,
                           const std::set<ImageId>& second, const Reconstruction& merged);

}  // namespace skein
