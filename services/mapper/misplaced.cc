#include "mapper/misplaced.h"

#include <algorithm>
#include <map>
#include <numeric>
#include <unordered_map>

#include "base/projection.h"

namespace skein {
namespace {

struct Votes {
  int agree = 0;
  int contradict = 0;
  void Add(const Votes& other) {
    agree += other.agree;
    contradict += other.contradict;
  }
};

struct Edge {
  int a = 0, b = 0;
  Votes votes;
};

bool SeenAt(const colmap::Reconstruction& reconstruction, const colmap::Image& image,
            const Eigen::Vector2d& pixel, Point3DId id, double max_error_px) {
  return colmap::CalculateSquaredReprojectionError(
             pixel, reconstruction.Point3D(id).XYZ(), image.Qvec(), image.Tvec(),
             reconstruction.Camera(image.CameraId())) <= max_error_px * max_error_px;
}

// Matches of which both keypoints have a point.
Votes CountVotes(const MisplacedOptions& options, const SceneMap& map, ImageId id1, ImageId id2) {
  const colmap::Reconstruction& reconstruction = map.reconstruction();
  const colmap::Image& image1 = reconstruction.Image(id1);
  const colmap::Image& image2 = reconstruction.Image(id2);
  Votes votes;
  for (const auto& match : map.graph().FindCorrespondencesBetweenImages(id1, id2)) {
    const colmap::Point2D& keypoint1 = image1.Point2D(match.point2D_idx1);
    const colmap::Point2D& keypoint2 = image2.Point2D(match.point2D_idx2);
    if (!keypoint1.HasPoint3D() || !keypoint2.HasPoint3D()) continue;
    const bool agree =
        keypoint1.Point3DId() == keypoint2.Point3DId() ||
        SeenAt(reconstruction, image2, keypoint2.XY(), keypoint1.Point3DId(),
               options.max_error_px) ||
        SeenAt(reconstruction, image1, keypoint1.XY(), keypoint2.Point3DId(), options.max_error_px);
    ++(agree ? votes.agree : votes.contradict);
  }
  return votes;
}

// Groups of photos, with the votes between any two.
class Groups {
 public:
  explicit Groups(size_t count) : parent_(count), members_(count), votes_(count) {
    std::iota(parent_.begin(), parent_.end(), 0);
    for (size_t i = 0; i < count; ++i) members_[i] = {static_cast<int>(i)};
  }

  void AddVotes(const Edge& edge) {
    votes_[edge.a][edge.b].Add(edge.votes);
    votes_[edge.b][edge.a].Add(edge.votes);
  }

  void JoinIfTheyAgree(int a, int b) {
    a = parent_[a];
    b = parent_[b];
    if (a == b) return;
    const Votes& between = votes_[a][b];
    if (between.contradict > between.agree) return;
    if (members_[a].size() < members_[b].size()) std::swap(a, b);
    for (const int member : members_[b]) {
      parent_[member] = a;
      members_[a].push_back(member);
    }
    members_[b].clear();
    for (const auto& [other, votes] : votes_[b]) {
      votes_[other].erase(b);
      if (other == a) continue;
      votes_[a][other].Add(votes);
      votes_[other][a].Add(votes);
    }
    votes_[b].clear();
  }

  // Members of groups that a larger group which stays contradicts.
  std::vector<int> Contradicted(int min_contradiction) const {
    std::vector<int> by_size;
    for (size_t i = 0; i < members_.size(); ++i) {
      if (!members_[i].empty()) by_size.push_back(static_cast<int>(i));
    }
    std::stable_sort(by_size.begin(), by_size.end(),
                     [this](int a, int b) { return members_[a].size() > members_[b].size(); });
    std::vector<char> stays(members_.size(), false);
    std::vector<int> result;
    for (const int group : by_size) {
      int excess = 0;
      for (const auto& [other, votes] : votes_[group]) {
        if (stays[other]) excess = std::max(excess, votes.contradict - votes.agree);
      }
      stays[group] = excess < min_contradiction;
      if (stays[group]) continue;
      result.insert(result.end(), members_[group].begin(), members_[group].end());
    }
    return result;
  }

 private:
  std::vector<int> parent_;
  std::vector<std::vector<int>> members_;
  std::vector<std::map<int, Votes>> votes_;
};

}  // namespace

std::vector<ImageId> FindMisplaced(const MisplacedOptions& options, const SceneMap& map) {
  std::vector<ImageId> ids = map.reconstruction().RegImageIds();
  std::sort(ids.begin(), ids.end());
  std::unordered_map<ImageId, int> index;
  for (const ImageId id : ids) index.emplace(id, static_cast<int>(index.size()));
  std::vector<Edge> edges;
  for (const auto& [id1, id2] : map.pairs()) {
    if (index.count(id1) == 0 || index.count(id2) == 0) continue;
    edges.push_back({index[id1], index[id2], CountVotes(options, map, id1, id2)});
  }
  Groups groups(ids.size());
  for (const Edge& edge : edges) groups.AddVotes(edge);
  std::stable_sort(edges.begin(), edges.end(), [](const Edge& a, const Edge& b) {
    return a.votes.agree - a.votes.contradict > b.votes.agree - b.votes.contradict;
  });
  for (const Edge& edge : edges) {
    if (edge.votes.agree > 0) groups.JoinIfTheyAgree(edge.a, edge.b);
  }
  std::vector<ImageId> misplaced;
  for (const int i : groups.Contradicted(options.min_contradiction)) misplaced.push_back(ids[i]);
  std::sort(misplaced.begin(), misplaced.end());
  return misplaced;
}

}  // namespace skein
