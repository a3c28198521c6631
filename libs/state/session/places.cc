#include "session/places.h"

#include <algorithm>
#include <map>

#include "core/disjoint_sets.h"
#include "core/limits.h"

namespace skein {
namespace {

// Whether a merge of the two has found different, visually similar places.
bool AreSimilarPlaces(const SessionState& session, int64_t submap_id, int64_t other_id) {
  return std::any_of(session.merges().begin(), session.merges().end(), [&](const auto& merge) {
    const merge_t& latest = merge.second.latest();
    return latest.similar_places != 0 &&
           std::minmax(latest.source_id, latest.target_id) == std::minmax(submap_id, other_id);
  });
}

void LeaveOutSimilarPlaces(const SessionState& session, Place* place) {
  const std::vector<int64_t> all = place->submaps;
  for (size_t i = 1; i < all.size(); ++i) {
    if (!AreSimilarPlaces(session, all[0], all[i])) continue;
    const SubmapLife& largest = *session.FindSubmap(all[0]);
    const SubmapLife& similar = *session.FindSubmap(all[i]);
    const auto is_its = [&](int64_t id) {
      return similar.IsRegistered(id) && !largest.IsRegistered(id);
    };
    auto& photos = place->photos;
    photos.erase(std::remove_if(photos.begin(), photos.end(), is_its), photos.end());
    place->submaps.erase(std::find(place->submaps.begin(), place->submaps.end(), all[i]));
  }
}

}  // namespace

std::vector<Place> FindPlaces(const SessionState& session) {
  DisjointSets<int64_t> sets;
  for (const auto& [id, photo] : session.photos()) {
    for (const CovisibilityGraph::Edge& edge : session.covisibility().EdgesOf(id)) {
      if (edge.num_inliers >= limits::kMinPoseInliers) sets.Join(id, edge.other_id);
    }
  }
  std::map<int64_t, Place> places;
  for (const auto& [id, photo] : session.photos()) {
    if (photo.matches_seq > 0) places[sets.Find(id)].photos.push_back(id);
  }
  std::vector<std::pair<int64_t, int64_t>> by_size;  // -photos, submap
  for (const auto& [id, submap] : session.submaps()) {
    if (!submap.ended) by_size.emplace_back(-submap.num_registered, id);
  }
  std::sort(by_size.begin(), by_size.end());
  for (const auto& [unused, submap_id] : by_size) {
    const std::vector<int64_t> registered = session.RegisteredIn(submap_id);
    if (registered.empty()) continue;
    const auto place = places.find(sets.Find(registered.front()));
    if (place != places.end()) place->second.submaps.push_back(submap_id);
  }
  std::vector<Place> found;
  for (auto& [unused, place] : places) {
    LeaveOutSimilarPlaces(session, &place);
    found.push_back(std::move(place));
  }
  return found;
}

const Place* FindDividedPlace(const std::vector<Place>& places, int64_t largest_submap) {
  const auto place = std::find_if(places.begin(), places.end(), [&](const Place& p) {
    return p.IsDivided() && p.submaps.front() == largest_submap;
  });
  return place == places.end() ? nullptr : &*place;
}

bool IsOfDividedPlace(const std::vector<Place>& places, int64_t submap_id) {
  return std::any_of(places.begin(), places.end(), [submap_id](const Place& place) {
    const auto& submaps = place.submaps;
    return place.IsDivided() &&
           std::find(submaps.begin(), submaps.end(), submap_id) != submaps.end();
  });
}

bool HasDividedPlace(const std::vector<Place>& places) {
  return std::any_of(places.begin(), places.end(),
                     [](const Place& place) { return place.IsDivided(); });
}

}  // namespace skein
