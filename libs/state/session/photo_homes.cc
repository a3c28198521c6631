#include "session/photo_homes.h"

#include <algorithm>

namespace skein {
namespace {

// The older of equals.
bool IsLarger(const SessionState& session, int64_t submap_id, int64_t other_id) {
  const int64_t num_ours = session.FindSubmap(submap_id)->num_registered;
  const int64_t num_theirs = session.FindSubmap(other_id)->num_registered;
  return num_ours > num_theirs || (num_ours == num_theirs && submap_id < other_id);
}

bool HoldsAllOf(const SubmapLife& holder, const SubmapLife& submap) {
  return std::all_of(submap.photos.begin(), submap.photos.end(), [&](const auto& photo) {
    return !submap.IsRegistered(photo.first) || holder.IsRegistered(photo.first);
  });
}

}  // namespace

std::map<int64_t, int64_t> SupportOf(const SessionState& session, int64_t image_id) {
  std::map<int64_t, int64_t> support;
  for (const auto& [submap_id, submap] : session.submaps()) {
    if (submap.ended) continue;
    int64_t inliers = 0;
    for (const CovisibilityGraph::Edge& edge : session.covisibility().EdgesOf(image_id)) {
      if (submap.IsRegistered(edge.other_id)) inliers += edge.num_inliers;
    }
    if (inliers > 0) support[submap_id] = inliers;
  }
  return support;
}

int64_t HeldElsewhere(const SessionState& session, int64_t image_id, int64_t submap_id) {
  for (const auto& [other_id, other] : session.submaps()) {
    if (other_id == submap_id || other.ended || other.num_registered < kMinHolder) continue;
    if (other.IsRegistered(image_id)) return other_id;
  }
  return 0;
}

int64_t HolderOfAll(const SessionState& session, int64_t submap_id) {
  const SubmapLife& submap = *session.FindSubmap(submap_id);
  for (const auto& [other_id, other] : session.submaps()) {
    if (other_id == submap_id || other.ended || !IsLarger(session, other_id, submap_id)) continue;
    if (HoldsAllOf(other, submap)) return other_id;
  }
  return 0;
}

int64_t LargerNeighbour(const SessionState& session, int64_t submap_id) {
  for (const int64_t image_id : session.RegisteredIn(submap_id)) {
    for (const auto& [other_id, inliers] : SupportOf(session, image_id)) {
      if (other_id != submap_id && IsLarger(session, other_id, submap_id)) return other_id;
    }
  }
  return 0;
}

int64_t HomeOf(const SessionState& session, int64_t image_id) {
  if (HeldElsewhere(session, image_id, 0) != 0) return 0;
  int64_t home = 0, most = 0;
  for (const auto& [submap_id, inliers] : SupportOf(session, image_id)) {
    const SubmapLife& submap = *session.FindSubmap(submap_id);
    if (inliers <= most || submap.photos.count(image_id) > 0) continue;  // it has it, or would not
    home = submap_id;
    most = inliers;
  }
  return home;
}

}  // namespace skein
