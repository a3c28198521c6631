#include "mapping/adjuster.h"

#include <algorithm>
#include <utility>

#include "core/clock.h"
#include "core/log.h"
#include "map/filters.h"
#include "map/retriangulation.h"
#include "map/track_completion.h"
#include "mapping/camera_models.h"
#include "mapping/local_adjustment.h"
#include "mapping/own_cameras.h"

namespace skein {
namespace {

// Rounds of global BA end when (observations filtered or added) / observations is smaller: in
// rounds that run to convergence, and in the rounds before them.
constexpr double kMaxChange = 0.0005;
constexpr double kMaxChangeBefore = 0.005;

}  // namespace

std::vector<ImageId> Adjuster::TakeAdjusted() { return std::exchange(adjusted_, {}); }

int Adjuster::AdjustLocally(ImageId new_image) {
  const BundleRequest request = SelectLocalWindow(map_, new_image, options_.local_ba_images);
  Bundle bundle = BuildBundle(map_, request);
  BundleOptions solve;
  solve.loss = Loss::kSoftL1;
  solve.max_iterations = 15;
  solve.function_tolerance = 1e-4;
  solve.num_threads = options_.num_threads;
  const BundleSummary summary = SolveBundle(solve, &bundle);
  if (!summary.usable) return summary.num_free_poses;
  ApplyBundle(bundle, &map_);
  FilterBundle(bundle, &map_);
  FilterNearPoints(request.free, &map_);
  CompleteLocally(new_image, &map_);
  // Observations added to long tracks were checked when they were added, so long tracks are not
  // filtered here.
  FilterPoints(WithoutLongTracks(map_, map_.ModifiedPoints()), &map_);
  adjusted_ = request.free;
  return summary.num_free_poses;
}

void Adjuster::AdjustImages(const std::vector<ImageId>& images) {
  BundleRequest request;
  request.free = images;
  request.points = PointsSeenBy(map_, request.free);
  request.held = ObserversOf(map_, request.points);
  Bundle bundle = BuildBundle(map_, request);
  if (!SolveBundle(GlobalBaOptions(false), &bundle).usable) return;
  ApplyBundle(bundle, &map_);
  FilterBundle(bundle, &map_);
  FilterNearPoints(request.free, &map_);
  adjusted_ = request.free;
}

// With outliers the solver converges slowly. Outliers are filtered between the rounds, so a later
// round starts close to its minimum.
BundleOptions Adjuster::GlobalBaOptions(bool converge) const {
  BundleOptions solve;
  solve.max_iterations = converge ? 30 : 10;
  solve.function_tolerance = converge ? 1e-6 : 1e-4;
  solve.loss = Loss::kSoftL1;
  solve.num_threads = options_.num_threads;
  solve.factor = factor_;
  solve.stop = options_.stop;
  return solve;
}

// Returns (observations filtered or added after the BA) / observations. Without `converge` tracks
// are completed and filtered; with it they are only filtered. `final`: by their errors alone.
double Adjuster::RunGlobalBa(bool converge, bool final) {
  const size_t num_observations = map_.reconstruction().ComputeNumObservations();
  ++cost_.num_rounds;
  Timer timer;
  Bundle bundle = BuildGlobalBundle(map_, true);
  const BundleSummary summary = SolveBundle(GlobalBaOptions(converge), &bundle);
  cost_.num_iterations += summary.iterations;
  cost_.num_decompositions += summary.num_decompositions;
  cost_.solve_s += timer.ElapsedS();
  if (!summary.usable) return 0;
  NoteGlobalBa(summary.factor, timer.ElapsedS());
  timer.Restart();
  ApplyBundle(bundle, &map_);
  size_t num_changed = 0;
  if (!converge) num_changed += GrowTracks(options_.num_threads, AllPoints(map_), &map_);
  const std::vector<Point3DId> points = AllPoints(map_);
  num_changed += final ? FilterObservations(points, &map_) : FilterPoints(points, &map_);
  num_changed += FilterNearPoints(map_.reconstruction().RegImageIds(), &map_);
  cost_.tracks_s += timer.ElapsedS();
  return static_cast<double>(num_changed) / std::max<size_t>(1, num_observations);
}

void Adjuster::AdjustUntilStable(int max_rounds, double max_change, bool converge, bool final) {
  for (int i = 0; i < max_rounds; ++i) {
    if (RunGlobalBa(converge, final) < max_change || options_.IsStopped()) break;
  }
}

void Adjuster::AdjustGlobally(int max_rounds, bool retriangulate, bool final) {
  if (retriangulate) {
    const Timer timer;
    GrowTracks(options_.num_threads, AllPoints(map_), &map_);
    Retriangulate(map_.pairs(), &map_);
    cost_.retriangulate_s += timer.ElapsedS();
  }
  AdjustUntilStable(max_rounds, final ? kMaxChangeBefore : kMaxChange, false, final);
  if (final && !options_.IsStopped()) AdjustUntilStable(max_rounds, kMaxChange, true, final);
  if (final) FilterPoints(AllPoints(map_), &map_);
  adjusted_ = map_.reconstruction().RegImageIds();
  MarkCamerasRefined();
  NoteSize();
}

bool Adjuster::ChooseIntrinsics() {
  const Timer timer;
  bool any = false;
  if (options_.camera_model == kModelByEvidence) {
    any |= ChooseCameraModels(GlobalBaOptions(false), &map_);
  }
  any |= ShareCamerasAgain(GlobalBaOptions(false), &map_);
  any |= GiveOwnCameras(GlobalBaOptions(true), &map_);
  cost_.solve_s += timer.ElapsedS();
  return any;
}

void Adjuster::Check(bool shape_is_known) {
  const Timer timer;
  if (!shape_is_known)
    check_.shape = CheckShape(BuildGlobalBundle(map_, true), options_.num_threads);
  check_.matches = CheckMatches(map_);
  LogInfo(
      "checked {} photos: position sigma {:.3f} % of the extent, {} of {} matches contradict "
      "({:.2f} s)",
      map_.reconstruction().NumRegImages(), 100 * check_.shape.position_sigma,
      check_.matches.num_contradicting, check_.matches.num_matches, timer.ElapsedS());
}

bool Adjuster::IsMapSmall() const {
  return static_cast<int>(map_.reconstruction().NumRegImages()) <= options_.max_images_all_global;
}

bool Adjuster::HasMapGrown() const {
  const Reconstruction& model = map_.reconstruction();
  return model.NumRegImages() >= options_.global_growth * size_at_global_.num_images ||
         model.NumPoints3D() >= options_.global_growth * size_at_global_.num_points;
}

void Adjuster::NoteSize() {
  size_at_global_.num_images = map_.reconstruction().NumRegImages();
  size_at_global_.num_points = map_.reconstruction().NumPoints3D();
}

void Adjuster::MarkCamerasRefined() {
  for (const auto& [id, state] : map_.camera_states()) {
    if (state.num_registered >= 2) map_.SetCameraRefined(id, true);
  }
}

}  // namespace skein
