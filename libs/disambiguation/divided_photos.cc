#include "disambiguation/divided_photos.h"

#include "map/image_pose.h"

namespace skein {

DividedPhotos DividePhotos(const SceneMap& map, const Reconstruction& first,
                           const Reconstruction& second, const Reconstruction& merged) {
  DividedPhotos divided;
  for (const ImageId id : merged.RegImageIds()) {
    const bool in_first = IsRegisteredIn(first, id), in_second = IsRegisteredIn(second, id);
    int64_t more_in_first = 0;
    for (const auto& [other, num_matches] : map.Neighbours(id)) {
      if (IsRegisteredIn(first, other)) more_in_first += num_matches;
      if (IsRegisteredIn(second, other)) more_in_first -= num_matches;
    }
    const bool is_of_first = in_first && (!in_second || more_in_first >= 0);
    (is_of_first ? divided.of_first : divided.of_second).insert(id);
  }
  return divided;
}

}  // namespace skein
