#include "map/photos_around.h"

#include <unordered_set>
#include <utility>

namespace skein {

std::vector<ImageId> RegisteredAround(const SceneMap& map, std::vector<ImageId> centers,
                                      size_t max_photos) {
  std::vector<ImageId> found = std::move(centers);
  if (found.size() > max_photos) found.resize(max_photos);
  std::unordered_set<ImageId> seen(found.begin(), found.end());
  for (size_t i = 0; i < found.size() && found.size() < max_photos; ++i) {
    for (const auto& [other, inliers] : map.Neighbours(found[i])) {
      if (found.size() >= max_photos) break;
      if (map.IsRegistered(other) && seen.insert(other).second) found.push_back(other);
    }
  }
  return found;
}

}  // namespace skein
