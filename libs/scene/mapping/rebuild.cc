#include "mapping/rebuild.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "core/log.h"
#include "mapping/global_map.h"
#include "mapping/misplaced.h"
#include "mapping/supported_photos.h"

namespace skein {
namespace {

void Ignore(const PhotoEvent&) {}

// Whether the photos of a camera have intrinsics of their own.
bool HasPhotosApart(const SceneMap& map) {
  const auto& cameras = map.camera_states();
  return std::any_of(cameras.begin(), cameras.end(),
                     [&](const auto& camera) { return map.HaveItsPhotosOwnCameras(camera.first); });
}

// The submap's photos and pairs, none registered.
std::unique_ptr<Submap> CopyWithoutModel(const Submap& submap, bool keeps_intrinsics) {
  SubmapOptions options = submap.options();
  options.background = false;
  std::unique_ptr<SceneMap> map = submap.map().Clone();
  keeps_intrinsics ? ClearButIntrinsics(map.get()) : map->Clear();
  auto anew = std::make_unique<Submap>(options, std::move(map));
  if (!submap.is_maintained()) anew->LeaveOutMaintenance();
  for (const int64_t id : submap.waiting().left_out()) anew->LeaveOut(id);
  return anew;
}

// The photos that it must not place.
std::set<ImageId> PhotosLeftOut(const Submap& submap, bool takes_held) {
  std::set<ImageId> ids;
  for (const ImageId id : submap.map().photos()) {
    const WaitingPhotos& waiting = submap.waiting();
    const bool is_free = submap.map().IsRegistered(id) || takes_held ||
                         (!waiting.IsHeldElsewhere(id) && !waiting.MatchesSimilarPlace(id));
    if (!is_free || waiting.left_out().count(id) > 0) ids.insert(id);
  }
  return ids;
}

// To be tried one by one.
void EnqueuePhotos(const Submap& submap, bool takes_held, const std::set<ImageId>& without,
                   Submap* anew) {
  for (const int64_t id : submap.waiting().held_elsewhere()) {
    if (!takes_held && !submap.map().IsRegistered(id)) anew->SetHeldElsewhere(id, true);
  }
  for (const ImageId id : submap.map().photos()) {
    if (without.count(id) == 0) anew->Enqueue(id);
  }
}

bool PlaceGlobally(const std::set<ImageId>& without, ImageId first, bool is_growing, Submap* anew) {
  MapGlobally(anew->options(), without, &anew->map());
  if (is_growing) KeepSupportedPhotos(&anew->map());
  const Reconstruction model = anew->map().reconstruction();
  if (model.NumRegImages() < 3) return false;
  SubmapState state;
  state.first = model.IsImageRegistered(first) ? first : model.RegImageIds().front();
  return anew->Restore(model, state).ok();
}

}  // namespace

std::unique_ptr<Submap> MapAnew(const Submap& submap, ImageId first, bool takes_held,
                                bool is_growing) {
  const MatchAgreement now = CountMatches(submap.options(), submap.map(), submap.waiting());
  const std::set<ImageId> without = PhotosLeftOut(submap, takes_held);
  std::unique_ptr<Submap> anew =
      CopyWithoutModel(submap, now.IsExplained() || HasPhotosApart(submap.map()));
  if (!PlaceGlobally(without, first, is_growing, anew.get())) return nullptr;
  anew->NoteMappedAnew();
  EnqueuePhotos(submap, takes_held, without, anew.get());
  anew->RefineUntilStable(Ignore);
  return anew;
}

std::unique_ptr<Submap> GrowToAll(const Submap& submap, ImageId first) {
  std::unique_ptr<Submap> grown = CopyWithoutModel(submap, true);
  SubmapState state;
  state.first = first;
  if (!grown->Restore(submap.map().reconstruction(), state).ok()) return nullptr;
  EnqueuePhotos(submap, true, PhotosLeftOut(submap, true), grown.get());
  grown->RefineUntilStable(Ignore);
  return grown;
}

bool MayWinMatches(const SubmapOptions& options, const MatchAgreement& agreement) {
  return static_cast<double>(agreement.to_win) >=
         options.min_rebuild_gain * static_cast<double>(agreement.agreeing);
}

MatchAgreement CountMatches(const SubmapOptions& options, const SceneMap& map,
                            const WaitingPhotos& waiting) {
  const auto is_left_out = [&](ImageId id) {
    return map.HasPhoto(id) && !map.IsRegistered(id) && !waiting.IsHeldElsewhere(id) &&
           !waiting.MatchesSimilarPlace(id);
  };
  MatchAgreement agreement;
  int64_t to_win_of_torn = 0;
  ImagePairs torn;
  for (const auto& [id1, id2] : map.pairs()) {
    if (options.IsStopped()) break;
    const bool registered1 = map.IsRegistered(id1), registered2 = map.IsRegistered(id2);
    if (!registered1 && !registered2) continue;
    const bool is_strong = map.IsStrongPair(id1, id2, kMinPairShare);
    if (registered1 && registered2) {
      const Votes votes = CountCommonPoints(map, id1, id2);
      agreement.agreeing += votes.agree;
      if (!is_strong) continue;
      agreement.strong_agreeing += votes.agree;
      agreement.strong += map.Neighbours(id1).at(id2);
      if (!IsTorn(votes)) continue;
      torn.emplace_back(id1, id2);
      to_win_of_torn += votes.contradict;
    } else if (is_strong && is_left_out(registered1 ? id2 : id1)) {
      agreement.to_win += map.Neighbours(id1).at(id2);
      ++agreement.num_left_out;
    }
  }
  if (!torn.empty() && !AreOfSimilarStructures(map, torn)) agreement.to_win += to_win_of_torn;
  if (!agreement.IsExplained()) {
    agreement.to_win = std::max(agreement.to_win, agreement.strong - agreement.strong_agreeing);
  }
  return agreement;
}

bool MapErrors::AreSmallerThan(const MapErrors& other) const {
  return num_photos >= other.num_photos && expected < other.expected &&
         (reprojection_px < other.reprojection_px || agreeing > other.agreeing) &&
         static_cast<double>(agreeing) >= kMinAgreeing * static_cast<double>(other.agreeing);
}

}  // namespace skein
