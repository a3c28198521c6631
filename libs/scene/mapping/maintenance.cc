#include "mapping/maintenance.h"

#include <algorithm>

#include "map/filters.h"
#include "map/retriangulation.h"
#include "map/track_completion.h"
#include "mapping/fold_back.h"

namespace skein {
namespace {

// Global BAs, each followed by filtering and retriangulation, after the last photo.
constexpr int kRoundsAtRest = 3;
constexpr double kMinRestS = 4.0;
constexpr double kRestPerGlobalBa = 10.0;
// A part of each phase.
constexpr size_t kPointsAtOnce = 3000;
constexpr size_t kPairsAtOnce = 200;
constexpr size_t kImagesAtOnce = 10;

// The last elements, at most `count`.
template <typename T>
std::vector<T> TakeLast(size_t count, std::vector<T>* from) {
  const auto begin = from->end() - std::min(count, from->size());
  const std::vector<T> taken(begin, from->end());
  from->erase(begin, from->end());
  return taken;
}

}  // namespace

double RestS(double last_global_ba_s) {
  return std::max(kMinRestS, kRestPerGlobalBa * last_global_ba_s);
}

Maintenance::ToCheck Maintenance::DoPart(double idle_s) {
  if (auto refined = background_.TakeIfDone()) {
    FoldBackRefined(&*refined);
    BeginPhases();
    return {adjuster_.TakeAdjusted(), {}, false, false, true};
  }
  switch (phase_) {
    case Phase::kPoints:
      return DoPoints();
    case Phase::kPairs:
      DoPairs();
      return {};
    case Phase::kImages:
      return DoImages();
    case Phase::kNone:
      break;
  }
  const bool at_rest = idle_s >= RestS(adjuster_.last_global_ba_s());
  if (at_rest && rounds_at_rest_ > 0 && !background_.IsRunning()) {
    --rounds_at_rest_;
    StartGlobalBa();
    return {{}, {}, false, true};
  }
  return {};
}

bool Maintenance::HasWork() const {
  return background_.IsRunning() || rounds_at_rest_ > 0 || phase_ != Phase::kNone;
}

void Maintenance::StartGlobalBa() {
  if (background_.IsRunning() || phase_ == Phase::kPoints) return;
  adjuster_.NoteSize();
  BundleOptions solve = adjuster_.GlobalBaOptions(false);
  solve.num_threads = 1;
  solve.stop = nullptr;  // what is folded back is refined to the end
  withdrawn_.clear();
  background_.Start(BuildGlobalBundle(map_, true), solve);
}

void Maintenance::OnWithdrawn(ImageId id) { withdrawn_.insert(id); }

void Maintenance::OnLocalBa() { rounds_at_rest_ = options_.background ? kRoundsAtRest : 0; }

void Maintenance::OnGlobalBa() {
  rounds_at_rest_ = 0;
  images_ = map_.reconstruction().RegImageIds();
  if (phase_ == Phase::kNone) phase_ = Phase::kImages;
}

void Maintenance::Drop() {
  background_.Cancel();
  points_.clear();
  pairs_.clear();
  images_.clear();
  phase_ = Phase::kNone;
}

// The photos that came while the bundle was refined get a bundle adjustment of their own. The
// refined pose of one that was withdrawn meanwhile is of a place where it was not left.
void Maintenance::FoldBackRefined(RefinedBundle* refined) {
  for (BundlePose& pose : refined->bundle.poses) {
    if (withdrawn_.count(pose.image_id) > 0) pose.constant = true;
  }
  const std::vector<ImageId> new_images = FoldBack(refined->bundle, &map_);
  adjuster_.MarkCamerasRefined();
  adjuster_.NoteGlobalBa(refined->factor, refined->seconds);
  adjuster_.NoteShape(refined->shape);
  if (!new_images.empty()) adjuster_.AdjustImages(new_images);
}

void Maintenance::BeginPhases() {
  points_ = AllPoints(map_);
  pairs_ = map_.pairs();
  phase_ = Phase::kPoints;
}

Maintenance::ToCheck Maintenance::DoPoints() {
  const std::vector<Point3DId> part = TakeLast(kPointsAtOnce, &points_);
  FilterPoints(part, &map_);
  GrowTracks(1, part, &map_);
  if (!points_.empty()) return {};
  phase_ = Phase::kPairs;
  return {map_.reconstruction().RegImageIds(), {}, false, false};
}

void Maintenance::DoPairs() {
  Retriangulate(TakeLast(kPairsAtOnce, &pairs_), &map_);
  if (!pairs_.empty()) return;
  images_ = map_.reconstruction().RegImageIds();
  phase_ = Phase::kImages;
}

Maintenance::ToCheck Maintenance::DoImages() {
  ToCheck check;
  check.contradicted = TakeLast(kImagesAtOnce, &images_);
  FilterNearPoints(check.contradicted, &map_);
  check.all_checked = images_.empty();
  if (check.all_checked) phase_ = Phase::kNone;
  return check;
}

}  // namespace skein
