#include "mapping/local_adjustment.h"

#include <algorithm>
#include <unordered_map>
#include <utility>
#include <vector>

namespace skein {
namespace {

// How many of the points each registered image sees, most first, then by id.
std::vector<std::pair<ImageId, int>> RankObservers(const SceneMap& map,
                                                   const std::vector<Point3DId>& points) {
  std::unordered_map<ImageId, int> counts;
  for (const Point3DId id : points) {
    for (const auto& element : map.reconstruction().Point3D(id).Track().Elements()) {
      ++counts[element.image_id];
    }
  }
  std::vector<std::pair<ImageId, int>> ranked(counts.begin(), counts.end());
  std::sort(ranked.begin(), ranked.end(), [](const auto& a, const auto& b) {
    return std::make_pair(-a.second, a.first) < std::make_pair(-b.second, b.first);
  });
  return ranked;
}

}  // namespace

BundleRequest SelectLocalWindow(const SceneMap& map, ImageId new_image, int num_images) {
  BundleRequest request;
  request.free.push_back(new_image);
  const std::vector<Point3DId> of_new = PointsSeenBy(map, {new_image});
  std::vector<ImageId> window;
  for (const auto& [id, count] : RankObservers(map, of_new)) {
    if (static_cast<int>(window.size()) + 1 >= num_images) break;
    if (id != new_image) window.push_back(id);
  }
  const size_t num_held = std::min<size_t>(2, window.size());
  request.held.assign(window.end() - num_held, window.end());
  request.free.insert(request.free.end(), window.begin(), window.end() - num_held);
  request.complete_points = WithoutLongTracks(map, of_new);
  request.points = Without(PointsSeenBy(map, request.free), request.complete_points);
  request.hold_open_points = true;
  return request;
}

}  // namespace skein
