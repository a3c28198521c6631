#include "mapping/experiments/tree_window.h"

#include <algorithm>
#include <set>
#include <stdexcept>
#include <unordered_map>
#include <unordered_set>

namespace skein {
namespace {

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

// The points of the free images. Over the limit half of them are the new photo's. The other free
// images share the rest evenly, as an image with few points moves with their errors.
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

// What weight p means for a pose's block of the normal equations.
PoseStiffness StiffnessOf(TreeForm form, double p) {
  if (form == TreeForm::kPaper) return {0.0, p};
  if (form == TreeForm::kConsistent) return {1.0 / p - 1.0, 1.0};
  return {};
}

}  // namespace

void TreeWindow::AddSimilar(ImageId id, const std::vector<std::pair<uint32_t, double>>& distances) {
  similar_.Add(id, distances);
}

BundleRequest TreeWindow::SelectWindow(const SceneMap& map, ImageId new_image) const {
  const size_t max_free = IsLimited() ? kMaxTreeFree : SIZE_MAX;
  const auto is_member = [&](uint32_t id) { return map.IsRegistered(id); };
  BundleRequest request;
  for (const TreeNode& node : BuildAssociationTree(similar_, new_image, is_member)) {
    if (node.weight > 0 && request.free.size() < max_free) {
      request.free.push_back(node.image_id);
      request.stiffness.push_back(StiffnessOf(form_, node.weight));
    } else {
      request.held.push_back(node.image_id);
    }
  }
  request.points = SelectPoints(map, request.free, IsLimited() ? max_points_ : 0);
  HoldObservers(map, &request);
  return request;
}

// Those of the tree first.
void TreeWindow::HoldObservers(const SceneMap& map, BundleRequest* request) const {
  std::set<ImageId> in_window(request->free.begin(), request->free.end());
  in_window.insert(request->held.begin(), request->held.end());
  const size_t max_held = IsLimited() ? kMaxTreeHeld : SIZE_MAX;
  if (request->held.size() > max_held) request->held.resize(max_held);
  for (const auto& [id, count] : RankObservers(map, request->points)) {
    if (request->held.size() >= max_held) break;
    if (in_window.insert(id).second) request->held.push_back(id);
  }
}

const std::vector<std::string>& LocalBaForms() {
  static const std::vector<std::string> kForms = {"colmap", "consistent", "equal", "paper"};
  return kForms;
}

LocalAdjustmentMaker MakerOf(const LocalBaOptions& options) {
  if (options.form == "colmap") {
    return [n = options.colmap_images] { return std::make_shared<ColmapWindow>(n); };
  }
  static const std::map<std::string, TreeForm> kTreeForms = {
      {"paper", TreeForm::kPaper},
      {"consistent", TreeForm::kConsistent},
      {"equal", TreeForm::kEqual},
  };
  const auto form = kTreeForms.find(options.form);
  if (form == kTreeForms.end()) throw std::invalid_argument("no local BA " + options.form);
  return [form = form->second] { return std::make_shared<TreeWindow>(form); };
}

}  // namespace skein
