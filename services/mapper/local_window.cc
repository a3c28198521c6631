#include "mapper/local_window.h"

#include <algorithm>
#include <map>
#include <set>
#include <stdexcept>

namespace skein {
namespace {

// Points of an image, with multiplicity removed.
std::vector<Point3DId> PointsOf(const SceneMap& map, ImageId id) {
  std::vector<Point3DId> points;
  for (const colmap::Point2D& point : map.reconstruction().Image(id).Points2D()) {
    if (point.HasPoint3D()) points.push_back(point.Point3DId());
  }
  std::sort(points.begin(), points.end());
  points.erase(std::unique(points.begin(), points.end()), points.end());
  return points;
}

// How many points of `ids` each registered image sees, most first.
std::vector<std::pair<ImageId, int>> Observers(const SceneMap& map,
                                               const std::vector<Point3DId>& ids) {
  std::map<ImageId, int> counts;
  for (const Point3DId id : ids) {
    for (const auto& element : map.reconstruction().Point3D(id).Track().Elements()) {
      ++counts[element.image_id];
    }
  }
  std::vector<std::pair<ImageId, int>> sorted(counts.begin(), counts.end());
  std::stable_sort(sorted.begin(), sorted.end(),
                   [](const auto& a, const auto& b) { return a.second > b.second; });
  return sorted;
}

// The points of the free images: those of the new photo first, then by the number of free images
// that see them, then by id.
std::vector<Point3DId> SelectPoints(const SceneMap& map, const std::vector<ImageId>& free,
                                    size_t limit) {
  std::unordered_map<Point3DId, int> counts;
  for (const ImageId id : free) {
    for (const Point3DId point : PointsOf(map, id)) counts[point] += id == free[0] ? 1000 : 1;
  }
  std::vector<std::pair<int, Point3DId>> ranked;
  for (const auto& [id, count] : counts) {
    if (map.reconstruction().Point3D(id).Track().Length() >= 2) ranked.emplace_back(-count, id);
  }
  std::sort(ranked.begin(), ranked.end());
  if (limit > 0 && ranked.size() > limit) ranked.resize(limit);
  std::vector<Point3DId> points;
  for (const auto& [count, id] : ranked) points.push_back(id);
  std::sort(points.begin(), points.end());
  return points;
}

// Observers of the image's points, but of those with long tracks, which stand firm.
std::vector<ImageId> ObserversOfShortTracks(const SceneMap& map, ImageId image_id) {
  constexpr size_t kMaxTrackLength = 15;
  std::vector<Point3DId> points;
  for (const Point3DId id : PointsOf(map, image_id)) {
    if (map.reconstruction().Point3D(id).Track().Length() <= kMaxTrackLength) points.push_back(id);
  }
  std::vector<ImageId> observers;
  for (const auto& [id, count] : Observers(map, points)) observers.push_back(id);
  return observers;
}

// COLMAP's local BA: the images with most common points, two of them held for the gauge. The new
// photo's points of short tracks are refined with all that see them; of the others those that
// images outside see, too, are held (incremental_mapper.cc, bundle_adjustment.cc of 3.8).
BundleRequest ColmapWindow(const LocalWindowOptions& options, const SceneMap& map,
                           ImageId new_image_id) {
  BundleRequest request;
  request.free.push_back(new_image_id);
  std::vector<ImageId> window;
  for (const auto& [id, count] : Observers(map, PointsOf(map, new_image_id))) {
    if (static_cast<int>(window.size()) + 1 >= options.colmap_images) break;
    if (id != new_image_id) window.push_back(id);
  }
  const size_t num_held = std::min<size_t>(2, window.size());
  request.held.assign(window.end() - num_held, window.end());
  request.free.insert(request.free.end(), window.begin(), window.end() - num_held);
  request.points = SelectPoints(map, request.free, 0);
  request.hold_open_points = true;
  for (const ImageId id : ObserversOfShortTracks(map, new_image_id)) {
    if (id != new_image_id && std::count(window.begin(), window.end(), id) == 0) {
      request.held.push_back(id);
    }
  }
  return request;
}

}  // namespace

LocalBaForm LocalBaFormFromName(const std::string& name) {
  if (name == "paper") return LocalBaForm::kPaper;
  if (name == "consistent") return LocalBaForm::kConsistent;
  if (name == "equal") return LocalBaForm::kEqual;
  if (name == "colmap") return LocalBaForm::kColmap;
  throw std::invalid_argument("unknown local BA '" + name +
                              "'; one of paper, consistent, equal, colmap");
}

BundleRequest SelectLocalWindow(const LocalWindowOptions& options, const SceneMap& map,
                                const SimilarityLists& similar, ImageId new_image_id) {
  if (options.form == LocalBaForm::kColmap) return ColmapWindow(options, map, new_image_id);
  const bool limited = options.form != LocalBaForm::kPaper;
  const auto is_member = [&](uint32_t id) { return map.IsRegistered(id); };
  BundleRequest request;
  std::set<ImageId> in_window;
  for (const TreeNode& node :
       BuildAssociationTree(options.tree, similar, new_image_id, is_member)) {
    const bool full = limited && options.max_free > 0 &&
                      static_cast<int>(request.free.size()) >= options.max_free;
    in_window.insert(node.image_id);
    if (node.weight > 0 && !full) {
      request.free.push_back(node.image_id);
      request.weights.push_back(node.weight);
    } else {
      request.held.push_back(node.image_id);
    }
  }
  request.points = SelectPoints(map, request.free, limited ? options.max_points : 0);
  const size_t max_held = limited && options.max_held > 0 ? options.max_held : SIZE_MAX;
  if (request.held.size() > max_held) request.held.resize(max_held);
  for (const auto& [id, count] : Observers(map, request.points)) {
    if (request.held.size() >= max_held) break;
    if (in_window.insert(id).second) request.held.push_back(id);
  }
  return request;
}

}  // namespace skein
