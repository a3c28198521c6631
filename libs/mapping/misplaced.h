#pragma once

#include <vector>

#include "map/scene_map.h"

namespace skein {

struct MisplacedOptions {
  double max_error_px = 12.0;  // of a matched point seen from the other photo, as in registration
  int min_contradiction = 30;  // matches by which contradiction must outweigh agreement
  // Pairs with a smaller part of the inliers of their photos' strongest pairs contradict nobody:
  // they are as often false, of an object that two places have in common
  // (docs/experiments/false_pairs.md).
  double min_pair_share = 0.03;
  std::size_t max_photos_around = 100;  // that FindMisplacedAround looks at
};

// Registered photos in parts of the map that stand in the wrong place. Repeated structure can tie a
// photo, and all that then grows from it, to a wrong spot by a few matches that agree; once the
// right neighbours are in, many more matches between the two parts connect points that lie apart.
// Photos are joined along their verified pairs, those with most agreeing matches first, but never
// two groups between which more matches contradict than agree. Of groups that contradict each
// other the larger one stays; the photos of the others are returned, in ascending order.
// Visits all pairs.
std::vector<ImageId> FindMisplaced(const MisplacedOptions& options, const SceneMap& map);

// The same among the registered photos nearest to `center` along verified pairs, at most
// `max_photos_around`: its cost does not grow with the map.
std::vector<ImageId> FindMisplacedAround(const MisplacedOptions& options, const SceneMap& map,
                                         ImageId center);

}  // namespace skein
