#include "covisibility/covisibility.h"

namespace skein {

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

}  // namespace skein
