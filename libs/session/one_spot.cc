#include "session/one_spot.h"

namespace skein {
namespace {

bool IsRegisteredIn(const SubmapLife& submap, int64_t image_id) {
  const auto found = submap.photos.find(image_id);
  return found != submap.photos.end() && found->second.state == registration_t::REGISTERED;
}

}  // namespace

bool IsOfOneSpot(const SessionState& session, int64_t submap_id) {
  const SubmapLife& submap = *session.FindSubmap(submap_id);
  const CovisibilityGraph& graph = session.covisibility();
  bool has_pairs = false;
  for (const auto& [id, photo] : submap.photos) {
    if (photo.state != registration_t::REGISTERED) continue;
    for (const CovisibilityGraph::Edge& edge : graph.EdgesOf(id)) {
      if (!IsRegisteredIn(submap, edge.other_id)) continue;
      if (!graph.IsOfOneSpot(id, edge)) return false;
      has_pairs = true;
    }
  }
  return has_pairs;
}

}  // namespace skein
