#include "session/one_spot.h"

namespace skein {

bool IsOfOneSpot(const SessionState& session, int64_t submap_id) {
  const SubmapLife& submap = *session.FindSubmap(submap_id);
  const CovisibilityGraph& graph = session.covisibility();
  bool has_pairs = false;
  for (const auto& [id, photo] : submap.photos) {
    if (photo.state != registration_t::REGISTERED) continue;
    for (const CovisibilityGraph::Edge& edge : graph.EdgesOf(id)) {
      if (!submap.IsRegistered(edge.other_id)) continue;
      if (!graph.IsOfOneSpot(id, edge)) return false;
      has_pairs = true;
    }
  }
  return has_pairs;
}

}  // namespace skein
