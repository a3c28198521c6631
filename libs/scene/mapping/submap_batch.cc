#include <algorithm>
#include <set>

#include "core/log.h"
#include "disambiguation/similar_structures.h"
#include "mapping/rebuild.h"
#include "mapping/submap.h"

// The part of Submap that maps all photos of a place at once.
namespace skein {
namespace {

// Expected position error, as a fraction of the extent, from which on a map may be the wrong one of
// several minima. Of simulated videos with a rolling shutter, maps 6 to 11 % off expect 0.9 to
// 3.4 %, maps 0.4 to 0.9 % off up to 0.8 %. Maps of still photos rarely expect as much.
constexpr double kLoosePosition = 0.005;

std::set<int64_t> PhotosOf(const std::vector<std::vector<int64_t>>& submaps) {
  std::set<int64_t> photos;
  for (const std::vector<int64_t>& ids : submaps) photos.insert(ids.begin(), ids.end());
  return photos;
}

}  // namespace

bool Submap::MapAsBatch(const Batch& batch, const EventSink& sink) {
  if (!map_->HasPhoto(first_) || options_.IsStopped()) return false;
  if (!batch.is_of_place && (settled_.consistent || IsVerdictKnown(batch))) return false;
  MatchAgreement now = CountMatches(options_, *map_, waiting_);
  if (options_.IsStopped()) return false;
  const auto is_whole = [&] {
    return map_->reconstruction().NumRegImages() == map_->photos().size();
  };
  // A map with wrong intrinsics would grow to one that is as wrong.
  const bool may_grow = batch.is_of_place && !is_whole() && now.IsExplained();
  // All photos at once may give less than one by one does: rotations of photos from many cameras
  // and far directions have several minima.
  const std::unique_ptr<Submap> grown = may_grow ? GrowToAll(*this, first_) : nullptr;
  if (options_.IsStopped()) return false;  // it may not be complete
  const bool has_grown = grown != nullptr && TakeFromBatch(batch, grown.get(), now, sink);
  if (has_grown) now = CountMatches(options_, *map_, waiting_);
  // The photos that it leaves out show similar places, so all at once would not join them.
  const auto has_all = [&] {
    return grown != nullptr &&
           !MayWin(batch, CountMatches(options_, grown->map(), grown->waiting()));
  };
  if (options_.IsStopped()) return has_grown;
  settled_.consistent = !MayWin(batch, now);
  if (settled_.consistent && (is_whole() || !batch.is_of_place || has_all())) return has_grown;
  const std::unique_ptr<Submap> anew = MapAnew(*this, first_, batch.is_of_place, batch.is_growing);
  if (options_.IsStopped()) return has_grown;  // it may not be complete
  num_pairs_rebuilt_ = map_->pairs().size();
  return (anew != nullptr && TakeFromBatch(batch, anew.get(), now, sink)) || has_grown;
}

// While photos come the last verdict holds until there are half as many pairs more; later, as long
// as the pairs are the same.
bool Submap::IsVerdictKnown(const Batch& batch) const {
  const size_t num_pairs = map_->pairs().size();
  return batch.is_growing ? 2 * num_pairs < 3 * num_pairs_rebuilt_
                          : num_pairs == num_pairs_rebuilt_;
}

// True if the map is another one now.
bool Submap::TakeFromBatch(const Batch& batch, Submap* anew, const MatchAgreement& now,
                           const EventSink& sink) {
  const bool has_taken_out = TakeOutSimilarPlaces(batch.others, anew);
  if (options_.IsStopped()) return false;  // it may not be settled
  const bool loses = batch.is_of_place && LosesPhotos(anew->map(), batch.others);
  const bool mixes = has_taken_out && !loses && MixesPlaces(anew->map(), batch.others);
  const size_t num_before = map_->reconstruction().NumRegImages();
  const int64_t agreeing = CountMatches(options_, anew->map(), anew->waiting_).agreeing;
  if (!loses && !mixes && TakeIfBetter(anew, agreeing, now, sink)) return true;
  const bool is_sound = batch.is_of_place || static_cast<double>(agreeing) >=
                                                 kMinAgreeing * static_cast<double>(now.agreeing);
  const bool absorbed =
      !mixes && is_sound && batch.absorb && HasOthers(anew->map()) && batch.absorb(*anew);
  LogInfo("batch: {} of {} photos, {} before, {} matches agree, {} before; {}",
          anew->map().reconstruction().NumRegImages(), map_->photos().size(), num_before, agreeing,
          now.agreeing,
          absorbed ? "absorbed"
          : loses  ? "others would be lost"
          : mixes  ? "visually similar places would be one"
                   : "no better");
  if (!absorbed) return false;
  settled_ = {};
  RefineUntilStable(sink);
  return true;
}

// Whether it has photos that this map lacks.
bool Submap::HasOthers(const SceneMap& anew) const {
  const std::vector<ImageId>& ids = anew.reconstruction().RegImageIds();
  return std::any_of(ids.begin(), ids.end(), [&](ImageId id) { return !map_->IsRegistered(id); });
}

// Photos that this map has and neither the new one nor another submap, against those that only the
// new one has.
bool Submap::LosesPhotos(const SceneMap& anew,
                         const std::vector<std::vector<int64_t>>& others) const {
  const std::set<int64_t> elsewhere = PhotosOf(others);
  int64_t num_lost = 0;
  for (const ImageId id : map_->photos()) {
    if (elsewhere.count(id) > 0) continue;
    num_lost += map_->IsRegistered(id) - anew.IsRegistered(id);
  }
  return num_lost > 0;
}

// As a merge's target judges a merged model: by what photos of two submaps show of each other's.
// The photos of the new map that belong to theirs, if the two show two places; else none.
std::set<ImageId> Submap::PhotosOfSimilarPlace(const SceneMap& anew,
                                               const std::vector<int64_t>& theirs) const {
  const std::vector<ImageId>& registered = map_->reconstruction().RegImageIds();
  DividedPhotos photos = DividePhotos(anew, {registered.begin(), registered.end()},
                                      {theirs.begin(), theirs.end()}, anew.reconstruction());
  const PlacesOfTwoSets places =
      ComparePlaces(anew, anew.reconstruction(), photos.of_first, photos.of_second);
  if (!places.differ) return {};
  LogInfo("batch: {} and {} photos show two places: {}", photos.of_first.size(),
          photos.of_second.size(), places.reason);
  return std::move(photos.of_second);
}

// They stay with the submap that holds them. So must photos that no submap holds, if they came with
// them. True if there were any.
bool Submap::TakeOutSimilarPlaces(const std::vector<std::vector<int64_t>>& others,
                                  Submap* anew) const {
  std::set<ImageId> out;
  for (const std::vector<int64_t>& theirs : others)
    out.merge(PhotosOfSimilarPlace(*anew->map_, theirs));
  if (out.empty()) return false;
  const std::set<int64_t> held = PhotosOf(others);
  std::vector<int64_t> free;
  for (const ImageId id : anew->map_->reconstruction().RegImageIds()) {
    if (!map_->IsRegistered(id) && held.count(id) == 0) free.push_back(id);
  }
  out.merge(PhotosOfSimilarPlace(*anew->map_, free));
  const EventSink ignore = [](const PhotoEvent&) {};
  for (const ImageId id : out) {
    anew->Withdraw(id, {Refusal::Cause::kSimilarPlace, "of a visually similar place"}, ignore);
    anew->SetHeldElsewhere(id, true);
  }
  anew->RefineUntilStable(ignore);
  return true;
}

bool Submap::MixesPlaces(const SceneMap& anew,
                         const std::vector<std::vector<int64_t>>& others) const {
  return std::any_of(others.begin(), others.end(), [&](const std::vector<int64_t>& theirs) {
    return !PhotosOfSimilarPlace(anew, theirs).empty();
  });
}

// While photos come, a single one that is left out is no reason.
bool Submap::MayWin(const Batch& batch, const MatchAgreement& now) const {
  return (!batch.is_growing && now.num_left_out > 0) || MayWinMatches(options_, now);
}

// Two maps agree with about as many matches if these differ by min_rebuild_gain. Then more photos
// are better.
bool Submap::TakeIfBetter(Submap* anew, int64_t agreeing, const MatchAgreement& now,
                          const EventSink& sink) {
  const size_t num_before = map_->reconstruction().NumRegImages();
  const size_t num_photos = anew->map().reconstruction().NumRegImages();
  const double gain =
      num_photos > num_before ? -options_.min_rebuild_gain : options_.min_rebuild_gain;
  if (static_cast<double>(agreeing) < (1 + gain) * static_cast<double>(now.agreeing)) return false;
  LogInfo("mapped anew: {} photos, {} before, {} matches agree, {} before", num_photos, num_before,
          agreeing, now.agreeing);
  ReplaceByRebuilt(anew, sink);
  return true;
}

void Submap::ReplaceByRebuilt(Submap* anew, const EventSink& sink) {
  anew->map().AlignTo(map_->reconstruction());
  maintenance_.Drop();
  std::vector<ImageId> before = map_->reconstruction().RegImageIds();
  std::sort(before.begin(), before.end());
  map_->ReplaceRegistered(anew->map().reconstruction());
  waiting_.ReplaceRecords(anew->waiting().records());
  adjuster_.MarkCamerasRefined();
  adjuster_.NoteSize();
  settled_ = anew->settled_;
  TellNewAndGone(before, {Refusal::Cause::kContradicted, "contradicted by the map made anew"},
                 sink);
}

// Wrong intrinsics of the first photos, or a photo at a false pose, bend the map that grows on
// them, and a map that is bent so can be a minimum of its own.
bool Submap::MayHaveSmallerError() const {
  return adjuster_.check().shape.position_sigma > kLoosePosition &&
         map_->pairs().size() != num_pairs_compared_;
}

MapErrors Submap::Errors() const {
  const SubmapStatistics statistics = Statistics();
  return {statistics.num_images, statistics.mean_reprojection_error_px,
          statistics.check.shape.position_sigma, CountMatches(options_, *map_, waiting_).agreeing};
}

// A map of all photos at once has no history. Both are finished, so that their errors can be
// compared: those that it shows and those that it expects.
void Submap::TakeSmallerError(const EventSink& sink) {
  const std::unique_ptr<Submap> anew = MapAnew(*this, first_, false, false);
  if (anew != nullptr) anew->AdjustWithPointsAnew([](const PhotoEvent&) {});
  if (options_.IsStopped()) return;
  num_pairs_compared_ = map_->pairs().size();
  if (anew == nullptr) return;
  const MapErrors before = Errors(), after = anew->Errors();
  const bool is_smaller = after.AreSmallerThan(before);
  LogInfo(
      "mapped anew for its error: {} photos, {:.3f} px for {} and {:.3f}, {:.3f} % expected, "
      "{:.3f} before, {} matches agree, {} before; {}",
      after.num_photos, after.reprojection_px, before.num_photos, before.reprojection_px,
      100 * after.expected, 100 * before.expected, after.agreeing, before.agreeing,
      is_smaller ? "taken" : "left");
  if (!is_smaller) return;
  ReplaceByRebuilt(anew.get(), sink);
  adjuster_.Check(false);
}

}  // namespace skein
