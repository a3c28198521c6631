#include "disambiguation/divided_photos.h"

namespace skein {

DividedPhotos DividePhotos(const SceneMap& map, const std::set<ImageId>& first,
                           const std::set<ImageId>& second, const Reconstruction& merged) {
  DividedPhotos divided;
  for (const ImageId id : merged.RegImageIds()) {
    const bool in_first = first.count(id) > 0, in_second = second.count(id) > 0;
    if (!in_first && !in_second) continue;
    int64_t more_in_first = 0;
    for (const auto& [other, num_matches] : map.Neighbours(id)) {
      if (first.count(other) > 0) more_in_first += num_matches;
      if (second.count(other) > 0) more_in_first -= num_matches;
    }
    const bool is_of_first = in_first && (!in_second || more_in_first >= 0);
    (is_of_first ? divided.of_first : divided.of_second).insert(id);
  }
  return divided;
}

}  // namespace skein
