#include "covisibility/covisibility.h"

#include <algorithm>
#include <unordered_set>

namespace skein {
namespace {

// A rotation leads to the edge's photo, by more inliers than `num_inliers`.
bool Turns(const CovisibilityGraph::Edge& edge, int32_t num_inliers) {
  return edge.IsRotation() && edge.num_inliers > num_inliers;
}

}  // namespace

void CovisibilityGraph::Add(int64_t image_id, const Edge& edge) {
  std::vector<Edge>& mine = edges_[image_id];
  std::vector<Edge>& others = edges_[edge.other_id];
  const bool mine_is_shorter = mine.size() <= others.size();
  const std::vector<Edge>& shorter = mine_is_shorter ? mine : others;
  const int64_t wanted = mine_is_shorter ? edge.other_id : image_id;
  for (const Edge& known : shorter) {
    if (known.other_id == wanted) return;
  }
  Edge reverse = edge;
  reverse.other_id = image_id;
  mine.push_back(edge);
  others.push_back(reverse);
}

const std::vector<CovisibilityGraph::Edge>& CovisibilityGraph::EdgesOf(int64_t image_id) const {
  static const std::vector<Edge> none;
  const auto found = edges_.find(image_id);
  return found == edges_.end() ? none : found->second;
}

bool CovisibilityGraph::IsOfOneSpot(int64_t image_id, const Edge& edge) const {
  if (edge.IsRotation()) return true;
  std::unordered_set<int64_t> thirds;
  for (const Edge& to_third : EdgesOf(image_id)) {
    if (Turns(to_third, edge.num_inliers)) thirds.insert(to_third.other_id);
  }
  const std::vector<Edge>& others = EdgesOf(edge.other_id);
  return !thirds.empty() && std::any_of(others.begin(), others.end(), [&](const Edge& to_third) {
    return Turns(to_third, edge.num_inliers) && thirds.count(to_third.other_id) > 0;
  });
}

}  // namespace skein
