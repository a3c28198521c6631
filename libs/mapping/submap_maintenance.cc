// What a submap does beside registration: background BA and what follows it.

#include <algorithm>
#include <unordered_set>

#include "mapping/bundle_builder.h"
#include "mapping/fold_back.h"
#include "mapping/retriangulation.h"
#include "mapping/submap.h"

namespace skein {

void Submap::StartBackgroundBa() {
  if (background_.IsRunning() || !points_to_maintain_.empty()) return;
  NoteSize();
  BundleOptions solve = GlobalBaOptions(false);
  solve.num_threads = 1;
  background_.Start(BuildGlobalBundle(*map_, true), solve);
}

bool Submap::Maintain(bool at_rest, const EventSink& sink) {
  if (const auto refined = background_.TakeIfDone()) {
    FoldBackRefined(*refined);
    points_to_maintain_ = AllPoints(*map_);
    pairs_to_maintain_ = map_->pairs();
    WithdrawWeak(std::exchange(last_adjusted_, {}), sink);
  } else if (!points_to_maintain_.empty()) {
    MaintainPoints();
    if (points_to_maintain_.empty()) WithdrawWeak(map_->reconstruction().RegImageIds(), sink);
  } else if (!pairs_to_maintain_.empty()) {
    MaintainPairs();
    if (pairs_to_maintain_.empty()) images_to_maintain_ = map_->reconstruction().RegImageIds();
  } else if (!images_to_maintain_.empty()) {
    MaintainImages(sink);
  } else if (at_rest && rounds_at_rest_ > 0 && !background_.IsRunning()) {
    --rounds_at_rest_;
    StartBackgroundBa();
  }
  return background_.IsRunning() || rounds_at_rest_ > 0 || !points_to_maintain_.empty() ||
         !pairs_to_maintain_.empty() || !images_to_maintain_.empty();
}

// The photos that came while the bundle was refined get a bundle adjustment of their own.
void Submap::FoldBackRefined(const RefinedBundle& refined) {
  BundleRequest request;
  request.free = FoldBack(refined, map_.get());
  MarkCamerasRefined();
  if (request.free.empty()) return;
  request.points = PointsSeenBy(*map_, request.free);
  request.held = ObserversOf(*map_, request.points);
  Bundle bundle = BuildBundle(*map_, request);
  if (!SolveBundle(GlobalBaOptions(false), &bundle).usable) return;
  ApplyBundle(bundle, map_.get());
  FilterBundle(options_.filter, bundle, map_.get());
  last_adjusted_ = request.free;
}

void Submap::MaintainPoints() {
  constexpr size_t kPointsAtOnce = 3000;
  std::unordered_set<Point3DId> points;
  while (!points_to_maintain_.empty() && points.size() < kPointsAtOnce) {
    points.insert(points_to_maintain_.back());
    points_to_maintain_.pop_back();
  }
  std::vector<Point3DId> sorted(points.begin(), points.end());
  std::sort(sorted.begin(), sorted.end());
  FilterPoints(options_.filter, sorted, map_.get());
  map_->triangulator().CompleteTracks(options_.triangulation, points);
  map_->triangulator().MergeTracks(options_.triangulation, points);
}

void Submap::MaintainPairs() {
  constexpr size_t kPairsAtOnce = 200;
  const size_t count = std::min(kPairsAtOnce, pairs_to_maintain_.size());
  const std::vector<std::pair<ImageId, ImageId>> pairs(pairs_to_maintain_.end() - count,
                                                       pairs_to_maintain_.end());
  pairs_to_maintain_.resize(pairs_to_maintain_.size() - count);
  RetriangulationOptions options;
  options.triangulation = options_.triangulation;
  Retriangulate(options, pairs, map_.get());
}

void Submap::MaintainImages(const EventSink& sink) {
  constexpr size_t kImagesAtOnce = 10;
  const size_t count = std::min(kImagesAtOnce, images_to_maintain_.size());
  const std::vector<ImageId> images(images_to_maintain_.end() - count, images_to_maintain_.end());
  images_to_maintain_.resize(images_to_maintain_.size() - count);
  WithdrawContradicted(images, sink);
  if (images_to_maintain_.empty() && is_doubtful_) WithdrawMisplaced(sink);
}

void Submap::DropMaintenance() {
  background_.Cancel();
  points_to_maintain_.clear();
  pairs_to_maintain_.clear();
  images_to_maintain_.clear();
}

}  // namespace skein
