#include "mapping/consistency.h"

#include <set>

#include "bundle/loosest_mode.h"
#include "core/threads.h"
#include "disambiguation/similar_structures.h"
#include "mapping/misplaced.h"
#include "mapping/model_check.h"
#include "mapping/registration.h"
#include "sfm/pose.h"

namespace skein {
namespace {

// Part of the points that its matches tie it to that a registered photo must observe. Looked at
// after each global BA. Registration asks for a quarter of them.
constexpr double kMinObservedRatio = 0.15;

}  // namespace

bool Consistency::IsWeak(ImageId id) const {
  const int num_points = static_cast<int>(map_.reconstruction().Image(id).NumPoints3D());
  return num_points < kMinTie;
}

Consistency::Contradiction Consistency::FindContradiction(ImageId id) const {
  const VisiblePoints visible = FindVisiblePoints(map_, id);
  const double observed = map_.reconstruction().Image(id).NumPoints3D();
  Contradiction contradiction;
  contradiction.fits_elsewhere = FitsElsewhere(map_, id, visible);
  contradiction.exists =
      contradiction.fits_elsewhere || observed < kMinObservedRatio * visible.size();
  return contradiction;
}

std::vector<ImageId> Consistency::FindPhotosWithBetterPose() const {
  const std::vector<ImageId>& registered = map_.reconstruction().RegImageIds();
  std::vector<char> has_better(registered.size());
  ForEachOnThreads(options_.num_threads, registered.size(), [&](size_t i) {
    has_better[i] = !options_.IsStopped() && HasBetterPose(map_, registered[i]);
  });
  std::vector<ImageId> found;
  for (size_t i = 0; i < registered.size(); ++i) {
    if (has_better[i]) found.push_back(registered[i]);
  }
  return found;
}

Withdrawal Consistency::FindMisplacedPhotos(ImageId first) const {
  Withdrawal found;
  found.photos = FindMisplaced(map_);
  found.refusal = {Refusal::Cause::kContradicted,
                   "in a part of the map that most matches contradict"};
  if (!found.photos.empty() && !OnlySimilarStructuresContradict(map_, found.photos)) return found;
  found.of_similar_place = true;
  found.refusal = {Refusal::Cause::kSimilarPlace, "of another, visually similar place"};
  found.photos = FindPhotosOfAnotherPlace(map_, first, options_.num_threads);
  if (!found.photos.empty() && WouldBeMergedAgain(found.photos)) found.photos.clear();
  if (found.photos.empty()) found.photos = FindByMissingCells(first);
  return found;
}

std::vector<ImageId> Consistency::FindUntiedPhotos() const {
  const Bundle bundle = BuildGlobalBundle(map_, false);
  const auto cut = FindThinnestCut(bundle, MaximumSpanningTree(bundle), kMinTie);
  std::vector<ImageId> photos;
  if (!cut) return photos;
  for (const int pose : cut->loose_side) photos.push_back(bundle.poses[pose].image_id);
  return photos;
}

bool Consistency::WouldBeMergedAgain(const std::vector<ImageId>& photos) const {
  const std::vector<ImageId>& registered = map_.reconstruction().RegImageIds();
  const std::set<ImageId> leaving(photos.begin(), photos.end());
  std::set<ImageId> staying(registered.begin(), registered.end());
  for (const ImageId id : photos) staying.erase(id);
  const PlacesOfTwoSets places = ComparePlaces(map_, map_.reconstruction(), staying, leaving);
  return places.num_votes > 0 && !places.differ;
}

std::vector<ImageId> Consistency::FindByMissingCells(ImageId first) const {
  SimilarPlaceCandidates candidates;
  for (const ImageId id : map_.photos()) {
    if (!waiting_.MatchesSimilarPlace(id)) continue;
    if (map_.IsRegistered(id)) {
      candidates.registered.insert(id);
      continue;
    }
    const PoseEstimate estimate =
        EstimatePose(map_, id, FindVisiblePoints(map_, id), waiting_.ContextOf(id));
    if (!estimate.has_too_many_missing_cells) continue;
    candidates.waiting[id] = ComposeProjectionMatrix(estimate.pose.R, estimate.pose.t);
  }
  if (candidates.IsEmpty()) return {};
  return FindPhotosOfAnotherPlaceByMissingCells(map_, first, candidates);
}

std::vector<ImageId> Consistency::FindPhotosWithTooManyMissingCells() const {
  std::vector<ImageId> ids;
  for (const ImageId id : map_.reconstruction().RegImageIds()) {
    if (waiting_.IsOfSimilarPlace(id) || !waiting_.MatchesSimilarPlace(id)) continue;
    const Image& image = map_.reconstruction().Image(id);
    const CellVotes votes = CompareWithNeighbours(
        map_, id, map_.reconstruction().Camera(image.CameraId()), image.ProjectionMatrix());
    if (HasTooManyMissingCells(votes)) ids.push_back(id);
  }
  return ids;
}

}  // namespace skein
