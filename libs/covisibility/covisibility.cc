#include "covisibility/covisibility.h"

namespace skein {

void CovisibilityGraph::Add(int64_t image_id, int64_t other_id, int32_t num_inliers, int64_t seq) {
  edges_[image_id].push_back({other_id, num_inliers, seq});
  edges_[other_id].push_back({image_id, num_inliers, seq});
}

const std::vector<CovisibilityGraph::Edge>& CovisibilityGraph::EdgesOf(int64_t image_id) const {
  static const std::vector<Edge> none;
  const auto found = edges_.find(image_id);
  return found == edges_.end() ? none : found->second;
}

}  // namespace skein
