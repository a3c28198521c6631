#include "mapping/supported_photos.h"

#include <algorithm>
#include <map>
#include <set>
#include <utility>
#include <vector>

#include "core/limits.h"
#include "core/log.h"

namespace skein {
namespace {

using PhotosOfPoint = std::vector<ImageId>;  // ascending, each once

// Points that two photos of `among` see.
std::vector<PhotosOfPoint> FindPhotosOfPoints(const SceneMap& map, const std::set<ImageId>& among) {
  std::vector<PhotosOfPoint> points;
  for (const auto& [id, point] : map.reconstruction().Points3D()) {
    std::set<ImageId> photos;
    for (const TrackElement& element : point.Track().Elements()) {
      if (among.count(element.image_id) > 0) photos.insert(element.image_id);
    }
    if (photos.size() >= 2) points.emplace_back(photos.begin(), photos.end());
  }
  return points;
}

// The two photos with most common points; none if those are too few for a map.
std::vector<ImageId> FindBestPair(const std::vector<PhotosOfPoint>& points) {
  std::map<std::pair<ImageId, ImageId>, int> num_common;
  for (const PhotosOfPoint& photos : points) {
    for (size_t i = 0; i < photos.size(); ++i) {
      for (size_t j = i + 1; j < photos.size(); ++j) ++num_common[{photos[i], photos[j]}];
    }
  }
  const auto best =
      std::max_element(num_common.begin(), num_common.end(),
                       [](const auto& a, const auto& b) { return a.second < b.second; });
  if (best == num_common.end() || best->second < limits::kMinPoseInliers) return {};
  return {best->first.first, best->first.second};
}

std::set<ImageId> Grow(const std::vector<PhotosOfPoint>& points) {
  std::map<ImageId, std::vector<size_t>> points_of;
  for (size_t i = 0; i < points.size(); ++i) {
    for (const ImageId id : points[i]) points_of[id].push_back(i);
  }
  std::set<ImageId> joined;
  std::vector<int> num_joined(points.size());
  std::map<ImageId, int> num_visible;  // points of two joined photos
  std::vector<ImageId> next = FindBestPair(points);
  while (!next.empty()) {
    const ImageId id = next.back();
    next.pop_back();
    if (!joined.insert(id).second) continue;
    for (const size_t point : points_of[id]) {
      if (++num_joined[point] != 2) continue;
      for (const ImageId other : points[point]) {
        if (++num_visible[other] == limits::kMinPoseInliers) next.push_back(other);
      }
    }
  }
  return joined;
}

}  // namespace

void KeepSupportedPhotos(SceneMap* map) {
  const std::vector<ImageId> registered = map->reconstruction().RegImageIds();
  std::set<ImageId> rest(registered.begin(), registered.end()), largest;
  while (rest.size() > largest.size()) {
    const std::set<ImageId> part = Grow(FindPhotosOfPoints(*map, rest));
    if (part.empty()) break;
    for (const ImageId id : part) rest.erase(id);
    if (part.size() > largest.size()) largest = part;
  }
  for (const ImageId id : registered) {
    if (largest.count(id) == 0) map->Deregister(id);
  }
  LogInfo("{} of {} photos support each other", largest.size(), registered.size());
}

}  // namespace skein
