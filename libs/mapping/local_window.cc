#include "mapping/local_window.h"

#include <algorithm>
#include <set>
#include <stdexcept>
#include <unordered_map>
#include <unordered_set>

namespace skein {
namespace {

// How many points of `ids` each registered image sees, most first, then by id.
std::vector<std::pair<ImageId, int>> RankedObservers(const SceneMap& map,
                                                     const std::vector<Point3DId>& ids) {
  std::unordered_map<ImageId, int> counts;
  for (const Point3DId id : ids) {
    for (const auto& element : map.reconstruction().Point3D(id).Track().Elements()) {
      ++counts[element.image_id];
    }
  }
  std::vector<std::pair<ImageId, int>> sorted(counts.begin(), counts.end());
  std::sort(sorted.begin(), sorted.end(), [](const auto& a, const auto& b) {
    return std::make_pair(-a.second, a.first) < std::make_pair(-b.second, b.first);
  });
  return sorted;
}

// Chooses points for images, those that most free images see first, then by id.
class PointChoice {
 public:
  PointChoice(const SceneMap& map, const std::vector<ImageId>& free) : map_(map) {
    for (const ImageId id : free) {
      num_chosen_[id] = 0;
      for (const Point3DId point : PointsSeenBy(map, {id})) --rank_[point].first;
    }
    for (auto it = rank_.begin(); it != rank_.end();) {
      it->second.second = it->first;
      const bool usable = map.reconstruction().Point3D(it->first).Track().Length() >= 2;
      it = usable ? std::next(it) : rank_.erase(it);
    }
  }

  size_t num_usable() const { return rank_.size(); }
  size_t size() const { return chosen_.size(); }

  // Points that the image sees, until it sees so many chosen ones.
  void Take(ImageId id, size_t count) {
    Take(Ranked(PointsSeenBy(map_, {id})), count, &num_chosen_[id]);
  }

  // Of all points, until so many are chosen.
  void Fill(size_t count) {
    std::vector<Point3DId> all;
    for (const auto& [id, rank] : rank_) all.push_back(id);
    size_t size = chosen_.size();
    Take(Ranked(all), count, &size);
  }

  std::vector<Point3DId> Sorted() const {
    std::vector<Point3DId> points(chosen_.begin(), chosen_.end());
    std::sort(points.begin(), points.end());
    return points;
  }

 private:
  std::vector<Point3DId> Ranked(const std::vector<Point3DId>& ids) const {
    std::vector<std::pair<int, Point3DId>> ranked;
    for (const Point3DId id : ids) {
      const auto it = rank_.find(id);
      if (it != rank_.end() && chosen_.count(id) == 0) ranked.push_back(it->second);
    }
    std::sort(ranked.begin(), ranked.end());
    std::vector<Point3DId> points;
    for (const auto& [count, id] : ranked) points.push_back(id);
    return points;
  }

  void Take(const std::vector<Point3DId>& ranked, size_t count, size_t* num_taken) {
    const size_t before = chosen_.size();
    const size_t start = *num_taken;
    for (const Point3DId id : ranked) {
      if (start + chosen_.size() - before >= count) break;
      chosen_.insert(id);
      for (const auto& element : map_.reconstruction().Point3D(id).Track().Elements()) {
        const auto it = num_chosen_.find(element.image_id);
        if (it != num_chosen_.end()) ++it->second;
      }
    }
    *num_taken = start + chosen_.size() - before;
  }

  const SceneMap& map_;
  std::unordered_map<Point3DId, std::pair<int, Point3DId>> rank_;
  std::unordered_map<ImageId, size_t> num_chosen_;  // of each free image
  std::unordered_set<Point3DId> chosen_;
};

// The points of the free images. Over the limit: half of them the new photo's, and of the others
// each free image gets its share, as one that is left with a few points moves with their errors.
std::vector<Point3DId> SelectPoints(const SceneMap& map, const std::vector<ImageId>& free,
                                    size_t limit) {
  PointChoice choice(map, free);
  if (limit == 0 || choice.num_usable() <= limit) {
    choice.Fill(choice.num_usable());
    return choice.Sorted();
  }
  choice.Take(free[0], limit / 2);
  const size_t share = free.size() < 2 ? 0 : (limit - choice.size()) / (free.size() - 1);
  for (size_t i = 1; i < free.size(); ++i) choice.Take(free[i], share);
  choice.Fill(limit);
  return choice.Sorted();
}

// COLMAP's local BA: the images with most common points, two of them held for the gauge. The new
// photo's points that are not firm are refined with all that see them; of the others those that
// images outside see, too, are held (incremental_mapper.cc, bundle_adjustment.cc of 3.8).
BundleRequest ColmapWindow(const LocalWindowOptions& options, const SceneMap& map,
                           ImageId new_image_id) {
  BundleRequest request;
  request.free.push_back(new_image_id);
  std::vector<ImageId> window;
  for (const auto& [id, count] : RankedObservers(map, PointsSeenBy(map, {new_image_id}))) {
    if (static_cast<int>(window.size()) + 1 >= options.colmap_images) break;
    if (id != new_image_id) window.push_back(id);
  }
  const size_t num_held = std::min<size_t>(2, window.size());
  request.held.assign(window.end() - num_held, window.end());
  request.free.insert(request.free.end(), window.begin(), window.end() - num_held);
  request.complete_points = WithoutFirm(map, PointsSeenBy(map, {new_image_id}));
  request.points = Without(PointsSeenBy(map, request.free), request.complete_points);
  request.hold_open_points = true;
  return request;
}

}  // namespace

const std::map<std::string, LocalBaForm>& LocalBaForms() {
  static const std::map<std::string, LocalBaForm> kForms = {
      {"paper", LocalBaForm::kPaper},
      {"consistent", LocalBaForm::kConsistent},
      {"equal", LocalBaForm::kEqual},
      {"colmap", LocalBaForm::kColmap},
  };
  return kForms;
}

std::string NameOf(LocalBaForm form) {
  for (const auto& [name, other] : LocalBaForms()) {
    if (other == form) return name;
  }
  throw std::invalid_argument("a local BA without a name");
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
  for (const auto& [id, count] : RankedObservers(map, request.points)) {
    if (request.held.size() >= max_held) break;
    if (in_window.insert(id).second) request.held.push_back(id);
  }
  return request;
}

}  // namespace skein
