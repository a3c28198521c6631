#include "mapping/rebuild.h"

#include <algorithm>
#include <map>
#include <utility>
#include <vector>

#include "core/limits.h"
#include "mapping/misplaced.h"
#include "mapping/similar_pairs.h"

namespace skein {
namespace {

void Ignore(const PhotoEvent&) {}

std::vector<ImageId> NeighboursMostInliersFirst(const SceneMap& map, ImageId id) {
  std::vector<std::pair<int, ImageId>> ranked;
  for (const auto& [other, inliers] : map.Neighbours(id)) ranked.emplace_back(-inliers, other);
  std::sort(ranked.begin(), ranked.end());
  std::vector<ImageId> neighbours;
  for (const auto& [inliers, other] : ranked) neighbours.push_back(other);
  return neighbours;
}

// At each angle, which is relaxed stepwise as the merger does.
bool StartFromBestPairOf(ImageId id, Submap* submap) {
  const std::vector<ImageId> neighbours = NeighboursMostInliersFirst(submap->map(), id);
  for (const double angle_deg : limits::kInitialAnglesDeg) {
    InitialPairOptions options;
    options.min_triangulation_angle_deg = angle_deg;
    for (const ImageId other : neighbours) {
      if (submap->Start(options, id, other, Ignore).status.ok()) return true;
    }
  }
  return false;
}

// What was found out of the cameras helps a beginning most.
void ClearButIntrinsics(SceneMap* map) {
  std::map<CameraId, std::vector<double>> found;
  for (const auto& [id, state] : map->camera_states()) {
    const colmap::Camera& camera = map->reconstruction().Camera(id);
    if (state.refined && HasPossibleIntrinsics(camera)) found[id] = camera.Params();
  }
  map->Clear();
  for (const auto& [id, params] : found) {
    map->SetCamera(id, params);
    map->SetCameraRefined(id, true);
  }
}

std::unique_ptr<Submap> StartAnew(const Submap& submap, ImageId first, bool takes_held) {
  SubmapOptions options = submap.options();
  options.background = false;
  options.max_images_begin_anew = 0;
  std::unique_ptr<SceneMap> map = submap.map().Clone();
  ClearButIntrinsics(map.get());
  auto anew = std::make_unique<Submap>(options, submap.local_adjustment(), std::move(map));
  if (!submap.is_maintained()) anew->LeaveOutMaintenance();
  for (const int64_t id : submap.waiting().left_out()) anew->LeaveOut(id);
  if (!StartFromBestPairOf(first, anew.get())) return nullptr;
  for (const int64_t id : submap.waiting().held_elsewhere()) {
    if (!takes_held && !submap.map().IsRegistered(id)) anew->SetHeldElsewhere(id, true);
  }
  for (const ImageId id : submap.map().photos()) {
    const bool is_registered = submap.map().IsRegistered(id);
    if (is_registered || !submap.waiting().MatchesSimilarPlace(id)) anew->Enqueue(id);
  }
  return anew;
}

}  // namespace

std::unique_ptr<Submap> MapAnew(const Submap& submap, ImageId first, bool takes_held) {
  std::unique_ptr<Submap> anew = StartAnew(submap, first, takes_held);
  if (anew != nullptr) anew->RefineUntilStable(Ignore);
  return anew;
}

std::unique_ptr<Submap> MapPartAnew(const Submap& submap, ImageId first, size_t max_images) {
  std::unique_ptr<Submap> anew = StartAnew(submap, first, false);
  if (anew == nullptr) return nullptr;
  while (anew->map().reconstruction().NumRegImages() < max_images && anew->Step(Ignore)) continue;
  return anew;
}

MatchAgreement CountMatches(const SubmapOptions& options, const SceneMap& map,
                            const WaitingPhotos& waiting) {
  const auto is_left_out = [&](ImageId id) {
    return map.HasPhoto(id) && !map.IsRegistered(id) && !waiting.IsHeldElsewhere(id) &&
           !waiting.MatchesSimilarPlace(id);
  };
  MatchAgreement agreement;
  int64_t to_win_of_torn = 0;
  std::vector<std::pair<ImageId, ImageId>> torn;
  for (const auto& [id1, id2] : map.pairs()) {
    if (options.IsStopped()) break;
    const bool registered1 = map.IsRegistered(id1), registered2 = map.IsRegistered(id2);
    if (!registered1 && !registered2) continue;
    const bool is_strong = map.IsStrongPair(id1, id2, options.misplaced.min_pair_share);
    if (registered1 && registered2) {
      const Votes votes = CountCommonPoints(map, id1, id2);
      agreement.agreeing += votes.agree;
      if (!is_strong || !IsTorn(votes)) continue;
      torn.emplace_back(id1, id2);
      to_win_of_torn += votes.contradict;
    } else if (is_strong && is_left_out(registered1 ? id2 : id1)) {
      agreement.to_win += map.Neighbours(id1).at(id2);
    }
  }
  if (!torn.empty() && !AreOfSimilarStructures(options.registration, map, torn)) {
    agreement.to_win += to_win_of_torn;
  }
  return agreement;
}

}  // namespace skein
