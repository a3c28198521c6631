// A submap that the order of its photos has led astray is mapped anew, now that all are there.

#include <algorithm>
#include <utility>
#include <vector>

#include "base/similarity_transform.h"
#include "mapping/submap.h"

namespace skein {
namespace {

// Verified matches between registered photos that agree with their poses.
int64_t CountAgreeing(const RegistrationOptions& options, const SceneMap& map) {
  int64_t num_agreeing = 0;
  for (const ImageId id : map.reconstruction().RegImageIds()) {
    num_agreeing += EpipolarVotes(map, id, options.max_epipolar_error_px).agree;
  }
  return num_agreeing / 2;
}

int MatchesWithRegistered(const SceneMap& map, ImageId id, double min_pair_share) {
  int num_matches = 0;
  for (const auto& [other, inliers] : map.Neighbours(id)) {
    if (!map.IsRegistered(other) || !map.IsStrongPair(id, other, min_pair_share)) continue;
    num_matches += inliers;
  }
  return num_matches;
}

// To the frame of another model of the same photos, as well as their centres allow.
void AlignTo(const colmap::Reconstruction& model, colmap::Reconstruction* aligned) {
  std::vector<Eigen::Vector3d> from, to;
  for (const ImageId id : aligned->RegImageIds()) {
    if (!model.IsImageRegistered(id)) continue;
    from.push_back(aligned->Image(id).ProjectionCenter());
    to.push_back(model.Image(id).ProjectionCenter());
  }
  colmap::SimilarityTransform3 transform;
  if (from.size() >= 3 && transform.Estimate<true>(from, to)) aligned->Transform(transform);
}

}  // namespace

bool Submap::IsTorn() const {
  for (const ImageId id : map_->photos()) {
    if (!map_->IsRegistered(id)) {
      const int num_matches = MatchesWithRegistered(*map_, id, options_.misplaced.min_pair_share);
      if (num_matches >= options_.min_torn_matches && !IsSuspect(id)) return true;
      continue;
    }
    const Votes votes = EpipolarVotes(*map_, id, options_.registration.max_epipolar_error_px);
    if (votes.Sum() >= options_.min_torn_matches &&
        votes.AgreeingShare() < options_.min_agreeing_share) {
      return true;
    }
  }
  return false;
}

// Most inliers first; at each angle, which is relaxed stepwise as the merger does.
bool Submap::StartFromBestPairOf(ImageId id) {
  constexpr double kAnglesDeg[] = {16, 8, 4, 2};
  std::vector<std::pair<int, ImageId>> others;
  for (const auto& [other, inliers] : map_->Neighbours(id)) others.emplace_back(-inliers, other);
  std::sort(others.begin(), others.end());
  for (const double angle_deg : kAnglesDeg) {
    for (const auto& [inliers, other] : others) {
      InitialPairOptions options;
      options.min_triangulation_angle_deg = angle_deg;
      if (Start(options, id, other, [](const PhotoEvent&) {}).ok) return true;
    }
  }
  return false;
}

// From the photo that it began with, so that maps of two places that look alike never change
// places.
void Submap::Rebuild(const EventSink& sink) {
  if (!map_->HasPhoto(side_.first)) return;
  if (num_pairs_rebuilt_ == map_->pairs().size() || !IsTorn()) return;
  num_pairs_rebuilt_ = map_->pairs().size();
  SubmapOptions options = options_;
  options.background = false;
  Submap anew(options);
  anew.map_ = map_->Clone();
  anew.map_->Clear();
  anew.side_.similar = side_.similar;
  if (!anew.StartFromBestPairOf(side_.first)) return;
  for (const ImageId id : map_->photos()) {
    if (map_->IsRegistered(id) || !IsSuspect(id)) anew.Enqueue(id);
  }
  const EventSink nobody = [](const PhotoEvent&) {};
  anew.Settle(nobody);
  const double needed = (1 + options_.min_rebuild_gain) *
                        static_cast<double>(CountAgreeing(options_.registration, *map_));
  if (static_cast<double>(CountAgreeing(options_.registration, *anew.map_)) < needed) return;
  TakeOver(&anew, sink);
}

// What became of the photos is told of those only whose state is another.
void Submap::TakeOver(Submap* anew, const EventSink& sink) {
  AlignTo(map_->reconstruction(), &anew->map_->reconstruction());
  std::vector<ImageId> before = map_->reconstruction().RegImageIds();
  std::sort(before.begin(), before.end());
  map_->ReplaceRegistered(anew->map_->reconstruction());
  for (auto& [id, trial] : anew->side_.trials) trial.looks_alike |= side_.trials[id].looks_alike;
  side_.trials = std::move(anew->side_.trials);
  queue_.clear();
  MarkCamerasRefined();
  NoteSize();
  is_consolidated_ = true;
  for (const ImageId id : before) {
    if (map_->IsRegistered(id)) continue;
    PhotoEvent event;
    event.image_id = id;
    event.state = PhotoEvent::State::kWithdrawn;
    event.reason = "contradicted by the submap mapped anew";
    side_.trials[id].deferred = true;
    sink(event);
  }
  for (const PhotoEvent& event : RegisteredEvents()) {
    if (!std::binary_search(before.begin(), before.end(), static_cast<ImageId>(event.image_id))) {
      sink(event);
    }
  }
}

}  // namespace skein
