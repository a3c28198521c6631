#include "mapping/submap.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/pose.h"
#include "base/projection.h"
#include "core/clock.h"
#include "map/track_completion.h"
#include "mapping/bundle_builder.h"
#include "mapping/fold_back.h"
#include "mapping/placement.h"
#include "mapping/retriangulation.h"

namespace skein {
namespace {

// Global BAs, each followed by filtering and retriangulation, after the last photo.
constexpr int kRoundsAtRest = 3;

WeightForm FormOfWeights(LocalBaForm form) {
  if (form == LocalBaForm::kPaper) return WeightForm::kPaper;
  if (form == LocalBaForm::kConsistent) return WeightForm::kConsistent;
  return WeightForm::kNone;
}

// Of the photo's own observations as the map stands.
double MeanError(const SceneMap& map, ImageId id) {
  const colmap::Image& image = map.reconstruction().Image(id);
  const colmap::Camera& camera = map.reconstruction().Camera(image.CameraId());
  double sum = 0;
  int count = 0;
  for (const colmap::Point2D& point2D : image.Points2D()) {
    if (!point2D.HasPoint3D()) continue;
    const Eigen::Vector3d& xyz = map.reconstruction().Point3D(point2D.Point3DId()).XYZ();
    const double squared = colmap::CalculateSquaredReprojectionError(
        point2D.XY(), xyz, image.Qvec(), image.Tvec(), camera);
    if (squared == std::numeric_limits<double>::max()) continue;  // behind the camera
    sum += std::sqrt(squared);
    ++count;
  }
  return count == 0 ? 0.0 : sum / count;
}

}  // namespace

Submap::Submap(const SubmapOptions& options)
    : options_(options), map_(std::make_unique<SceneMap>(options.camera_model)) {}

void Submap::AddSimilar(int64_t image_id,
                        const std::vector<std::pair<uint32_t, double>>& distances) {
  side_.similar.Add(static_cast<uint32_t>(image_id), distances);
}

InitialPairResult Submap::Start(const InitialPairOptions& options, int64_t image_id1,
                                int64_t image_id2, const EventSink& sink) {
  InitialPairResult result;
  if (!map_->HasPhoto(image_id1) || !map_->HasPhoto(image_id2) || image_id1 == image_id2) {
    result.reason = "the initial pair is not there";
    return result;
  }
  const double start = MonotonicS();
  const ImageId id1 = static_cast<ImageId>(image_id1), id2 = static_cast<ImageId>(image_id2);
  result = RegisterInitialPair(options, id1, id2, map_.get());
  if (!result.ok) return result;
  RefineGlobally(2, false, false);
  if (map_->reconstruction().Image(id1).NumPoints3D() <
      static_cast<Point2DIdx>(options.min_num_inliers / 2)) {
    map_->Deregister(id1);
    map_->Deregister(id2);
    result.ok = false;
    result.reason = "too few points after bundle adjustment";
    return result;
  }
  side_.first = id1;
  PoseEstimate estimate;
  estimate.num_visible = estimate.num_inliers = result.num_inliers;
  for (const ImageId id : {id1, id2}) {
    PhotoEvent event = RegisteredEvent(id, estimate);
    event.total_s = MonotonicS() - start;
    event.num_ba_images = 2;
    sink(event);
    queue_.erase(id);
    EnqueueNeighbours(id);
  }
  return result;
}

void Submap::Enqueue(int64_t image_id) {
  if (!map_->HasPhoto(image_id) || map_->IsRegistered(image_id)) return;
  const ImageId id = static_cast<ImageId>(image_id);
  if (side_.trials[id].rejected) return;
  queue_[id] = CountVisible(id);
}

int Submap::CountVisible(ImageId id) const {
  return static_cast<int>(FindVisiblePoints(*map_, id).size());
}

void Submap::EnqueueNeighbours(ImageId id) {
  for (const auto& [other, inliers] : map_->Neighbours(id)) {
    if (!map_->HasPhoto(other) || map_->IsRegistered(other) || side_.trials[other].rejected)
      continue;
    const int visible = CountVisible(other);
    const bool was_tried = side_.trials[other].deferred;
    if (queue_.count(other) > 0 || !was_tried || visible > side_.trials[other].last_visible) {
      queue_[other] = visible;
    }
  }
}

bool Submap::Step(const EventSink& sink) {
  Maintain(false, sink);
  if (queue_.empty()) return false;
  auto best = queue_.begin();
  for (auto it = queue_.begin(); it != queue_.end(); ++it) {
    if (it->second > best->second) best = it;
  }
  const ImageId id = best->first;
  queue_.erase(best);
  if (map_->IsRegistered(id)) return true;
  if (TryPhoto(id, sink)) EnqueueNeighbours(id);
  return true;
}

bool Submap::TryPhoto(ImageId id, const EventSink& sink) {
  const double start = MonotonicS();
  const VisiblePoints visible = FindVisiblePoints(*map_, id);
  PoseEstimate estimate = EstimatePose(*map_, id, visible, OptionsOfTrial(id));
  PhotoEvent event;
  event.image_id = id;
  event.register_s = MonotonicS() - start;
  side_.trials[id].last_visible = estimate.num_visible;
  is_doubtful_ = is_doubtful_ || estimate.misses_too_much;
  if (!estimate.ok) {
    event.total_s = event.register_s;
    Defer(estimate, id, event, sink);
    return false;
  }
  const double before_triangulation = MonotonicS();
  Placement placement(estimate, visible, id, options_.triangulation, map_.get());
  const double triangulate_s = MonotonicS() - before_triangulation;
  if (!IsDetermined(options_.registration, placement.sigmas())) {
    estimate.reason = "pose badly determined by its inliers";
  } else if (!placement.AgreesWithMatches(options_.registration) && !OthersAreMisplaced(id, sink)) {
    estimate.reason = "pose disagrees with the verified matches";
  }
  if (!estimate.reason.empty()) {
    placement.Undo();
    event.total_s = MonotonicS() - start;
    Defer(estimate, id, event, sink);
    return false;
  }
  is_consolidated_ = false;
  const Adjustment adjustment = Adjust(id);
  side_.trials[id].deferred = side_.trials[id].looks_alike = false;
  ambiguous_.erase(id);
  std::vector<ImageId> adjusted;
  std::swap(adjusted, last_adjusted_);
  const PhotoEvent timing = event;
  event = RegisteredEvent(id, estimate);
  event.register_s = timing.register_s;
  event.triangulate_s = triangulate_s;
  event.ba_s = adjustment.seconds;
  event.ba_cpu_s = adjustment.cpu_s;
  event.num_ba_images = adjustment.num_images;
  event.total_s = MonotonicS() - start;
  sink(event);
  WithdrawWeak(adjusted, sink);
  return map_->IsRegistered(id);
}

bool Submap::LooksAlike(ImageId id) const {
  const auto trial = side_.trials.find(id);
  return trial != side_.trials.end() && trial->second.looks_alike;
}

// Whether it, or a photo that it matches with, was found to be of a place that looks alike.
bool Submap::IsSuspect(ImageId id) const {
  const auto& neighbours = map_->Neighbours(id);
  return LooksAlike(id) || std::any_of(neighbours.begin(), neighbours.end(),
                                       [this](const auto& n) { return LooksAlike(n.first); });
}

RegistrationOptions Submap::OptionsOfTrial(ImageId id) const {
  RegistrationOptions registration = options_.registration;
  registration.suspect_look_alike = IsSuspect(id);
  registration.must_show_place = LooksAlike(id);
  if (static_cast<int>(ambiguous_.size()) >= options_.max_ambiguous) {
    registration.max_rival_ratio = HUGE_VAL;
  }
  return registration;
}

void Submap::NoteAmbiguous(ImageId id) {
  is_doubtful_ = true;
  if (!ambiguous_.insert(id).second) return;
  if (static_cast<int>(ambiguous_.size()) < options_.max_ambiguous) return;
  for (const ImageId waiting : ambiguous_) Enqueue(waiting);
}

void Submap::Defer(const PoseEstimate& estimate, ImageId id, PhotoEvent event,
                   const EventSink& sink) {
  if (estimate.is_ambiguous) NoteAmbiguous(id);
  if (side_.trials[id].deferred) return;
  side_.trials[id].deferred = true;
  event.state = PhotoEvent::State::kDeferred;
  event.reason = estimate.reason;
  event.num_visible = estimate.num_visible;
  event.num_inliers = estimate.num_inliers;
  sink(event);
}

PhotoEvent Submap::RegisteredEvent(ImageId id, const PoseEstimate& estimate) const {
  PhotoEvent event;
  event.image_id = id;
  event.state = PhotoEvent::State::kRegistered;
  event.num_visible = estimate.num_visible;
  event.num_inliers = estimate.num_inliers;
  event.qvec = map_->reconstruction().Image(id).Qvec();
  event.tvec = map_->reconstruction().Image(id).Tvec();
  event.mean_error_px = MeanError(*map_, id);
  return event;
}

void Submap::WithdrawWeak(const std::vector<ImageId>& images, const EventSink& sink) {
  for (const ImageId id : images) {
    if (!map_->IsRegistered(id)) continue;
    const int num_points = static_cast<int>(map_->reconstruction().Image(id).NumPoints3D());
    if (num_points >= options_.min_observations) continue;
    Withdraw(id, "too few observations left after bundle adjustment", sink);
  }
}

// Its matches tie it to points that it doesn't see where they are. Where they agree on another
// pose, that is evidence to try it again.
void Submap::WithdrawContradicted(const std::vector<ImageId>& images, const EventSink& sink) {
  for (const ImageId id : images) {
    if (!map_->IsRegistered(id)) continue;
    const VisiblePoints visible = FindVisiblePoints(*map_, id);
    const double observed = map_->reconstruction().Image(id).NumPoints3D();
    const bool elsewhere = FitsElsewhere(*map_, id, visible, options_.registration);
    if (!elsewhere && observed >= options_.min_observed_ratio * visible.size()) continue;
    Withdraw(id, "contradicted by most of its matches after bundle adjustment", sink);
    if (elsewhere) Enqueue(id);
  }
}

// Registered photos without others of their place, so that they have no points of their own which
// show that it is another. Told by what they miss, where there is reason to suspect them.
std::vector<ImageId> Submap::LoneLookAlikes() {
  std::vector<ImageId> ids;
  for (const ImageId id : map_->reconstruction().RegImageIds()) {
    if (LooksAlike(id) || !IsSuspect(id)) continue;
    const colmap::Image& image = map_->reconstruction().Image(id);
    const CellVotes votes = CompareWithNeighbours(options_.registration.look_alike, *map_, id,
                                                  map_->reconstruction().Camera(image.CameraId()),
                                                  image.ProjectionMatrix());
    if (MissesTooMuch(options_.registration.look_alike, votes)) ids.push_back(id);
  }
  return ids;
}

std::vector<ImageId> Submap::SuspectedLookAlikes() const {
  Suspicion suspicion;
  for (const ImageId id : map_->photos()) {
    if (!IsSuspect(id)) continue;
    if (map_->IsRegistered(id)) {
      suspicion.suspects.insert(id);
      continue;
    }
    const PoseEstimate estimate =
        EstimatePose(*map_, id, FindVisiblePoints(*map_, id), OptionsOfTrial(id));
    if (!estimate.misses_too_much) continue;
    suspicion.witnesses[id] = colmap::ComposeProjectionMatrix(estimate.pose.R, estimate.pose.t);
  }
  if (suspicion.IsEmpty()) return {};
  return FindSuspectedLookAlikes(options_.registration.look_alike, *map_, side_.first, suspicion);
}

// Of a photo on trial that many matches contradict and the photos that these lead to, those stay
// which are tied more firmly to the map. True, with the others withdrawn, if the photo is among
// them.
bool Submap::OthersAreMisplaced(ImageId on_trial, const EventSink& sink) {
  const std::vector<ImageId> misplaced = FindMisplacedAround(options_.misplaced, *map_, on_trial);
  if (misplaced.empty() || std::count(misplaced.begin(), misplaced.end(), on_trial) > 0) {
    return false;
  }
  WithdrawForRetry(misplaced, "contradicted by a photo that is tied more firmly to the map", sink);
  return true;
}

// They are tried again at once: what contradicts them says where they are.
void Submap::WithdrawForRetry(const std::vector<ImageId>& ids, const std::string& reason,
                              const EventSink& sink) {
  for (const ImageId id : ids) Withdraw(id, reason, sink);
  for (const ImageId id : ids) Enqueue(id);
}

// True if there were any.
bool Submap::WithdrawMisplaced(const EventSink& sink) {
  std::string reason = "in a part of the map that most matches contradict";
  std::vector<ImageId> misplaced = FindMisplaced(options_.misplaced, *map_);
  if (misplaced.empty()) {
    reason = "another place that looks alike";
    misplaced = FindLookAlikes(options_.registration.look_alike, *map_, side_.first);
    if (misplaced.empty()) misplaced = SuspectedLookAlikes();
    for (const ImageId id : misplaced) side_.trials[id].looks_alike = true;
    for (const ImageId id : LoneLookAlikes()) misplaced.push_back(id);
  }
  WithdrawForRetry(misplaced, reason, sink);
  if (!misplaced.empty()) {
    ambiguous_.clear();
    RetryDeferred();
  }
  is_doubtful_ = false;
  return !misplaced.empty();
}

bool Submap::TakeBack(int64_t image_id, const std::string& reason, const EventSink& sink) {
  if (!map_->IsRegistered(image_id)) return true;
  const ImageId id = static_cast<ImageId>(image_id);
  if (!Withdraw(id, reason, sink)) return false;
  side_.trials[id].last_visible = 0;
  return true;
}

void Submap::LeaveStrangersTo(const colmap::Reconstruction& other, const EventSink& sink) {
  const std::vector<ImageId> ids = map_->reconstruction().RegImageIds();
  for (const ImageId id : ids) {
    if (!other.ExistsImage(id) || !other.IsImageRegistered(id)) continue;
    const double there = other.Image(id).NumPoints3D();
    if (there < options_.stranger_ratio * map_->reconstruction().Image(id).NumPoints3D()) continue;
    if (Withdraw(id, "of a place that looks alike, which another submap holds", sink)) {
      side_.trials[id].looks_alike = true;
    }
  }
}

bool Submap::Withdraw(ImageId id, const std::string& reason, const EventSink& sink) {
  if (map_->reconstruction().NumRegImages() <= 2) return false;
  PhotoEvent event;
  event.image_id = id;
  event.num_inliers = static_cast<int>(map_->reconstruction().Image(id).NumPoints3D());
  map_->Deregister(id);
  is_consolidated_ = false;
  Trial& trial = side_.trials[id];
  trial.deferred = true;
  trial.last_visible = CountVisible(id);
  trial.rejected = ++trial.num_withdrawals > options_.max_withdrawals;
  event.state = trial.rejected ? PhotoEvent::State::kRejected : PhotoEvent::State::kWithdrawn;
  event.reason = reason;
  is_doubtful_ = true;
  sink(event);
  return true;
}

Submap::Adjustment Submap::Adjust(ImageId new_image) {
  const double start = MonotonicS(), cpu_start = ThreadCpuS();
  Adjustment adjustment;
  const size_t num_images = map_->reconstruction().NumRegImages();
  if (static_cast<int>(num_images) <= options_.max_images_all_global) {
    RefineGlobally(2, false, false);
    adjustment.num_images = static_cast<int>(num_images);
  } else {
    adjustment = AdjustLocally(new_image);
    rounds_at_rest_ = options_.background ? kRoundsAtRest : 0;
    if (HasGrown() && options_.background) {
      StartBackgroundBa();
    } else if (HasGrown()) {
      RefineGlobally(1, true, false);
    }
  }
  map_->triangulator().ClearModifiedPoints3D();
  adjustment.seconds = MonotonicS() - start;
  adjustment.cpu_s = ThreadCpuS() - cpu_start;
  return adjustment;
}

Submap::Adjustment Submap::AdjustLocally(ImageId new_image) {
  Adjustment adjustment;
  const BundleRequest request = SelectLocalWindow(options_.local, *map_, side_.similar, new_image);
  Bundle bundle = BuildBundle(*map_, request);
  BundleOptions solve;
  solve.loss = Loss::kSoftL1;
  solve.max_iterations = 15;
  solve.function_tolerance = 1e-4;
  solve.num_threads = options_.num_threads;
  solve.weight_form = FormOfWeights(options_.local.form);
  const BundleSummary summary = SolveBundle(solve, &bundle);
  adjustment.num_images = summary.num_free_poses;
  if (!summary.usable) return adjustment;
  ApplyBundle(bundle, map_.get());
  // COLMAP's form leaves no point out.
  if (options_.local.form != LocalBaForm::kColmap) SettlePointsBeside(request);
  FilterBundle(options_.filter, bundle, map_.get());
  CompleteLocally(options_.triangulation, new_image, map_.get());
  // What the firm ones have gained was checked as it was added.
  const auto& changed = map_->triangulator().GetModifiedPoints3D();
  std::vector<Point3DId> points(changed.begin(), changed.end());
  std::sort(points.begin(), points.end());
  FilterPoints(options_.filter, WithoutFirm(*map_, points), map_.get());
  last_adjusted_ = request.free;
  return adjustment;
}

void Submap::SettlePointsBeside(const BundleRequest& adjusted) {
  const std::unordered_set<Point3DId> inside(adjusted.points.begin(), adjusted.points.end());
  BundleRequest request;
  for (const Point3DId id : PointsSeenBy(*map_, adjusted.free)) {
    if (inside.count(id) == 0) request.points.push_back(id);
  }
  if (request.points.empty()) return;
  request.held = ObserversOf(*map_, request.points);
  Bundle bundle = BuildBundle(*map_, request);
  BundleOptions solve;
  solve.max_iterations = 3;
  solve.function_tolerance = 1e-3;
  if (!SolveBundle(solve, &bundle).usable) return;
  ApplyBundle(bundle, map_.get());
  FilterBundle(options_.filter, bundle, map_.get());
}

// Outliers make the tail of convergence long; they are filtered between the rounds, which then
// start close to their end.
BundleOptions Submap::GlobalBaOptions(bool last) const {
  BundleOptions solve;
  solve.max_iterations = last ? 30 : 10;
  solve.function_tolerance = last ? 1e-6 : 1e-4;
  solve.loss = Loss::kSoftL1;
  solve.num_threads = options_.num_threads;
  return solve;
}

double Submap::AdjustGlobally(const BundleOptions& options, int* num_images) {
  const size_t num_observations = map_->reconstruction().ComputeNumObservations();
  Bundle bundle = BuildGlobalBundle(*map_, true);
  const BundleSummary summary = SolveBundle(options, &bundle);
  if (num_images != nullptr) *num_images = summary.num_free_poses;
  if (!summary.usable) return 0;
  ApplyBundle(bundle, map_.get());
  size_t num_changed = map_->triangulator().CompleteAllTracks(options_.triangulation);
  num_changed += map_->triangulator().MergeAllTracks(options_.triangulation);
  num_changed += FilterPoints(options_.filter, AllPoints(*map_), map_.get());
  return static_cast<double>(num_changed) / std::max<size_t>(1, num_observations);
}

void Submap::RefineGlobally(int max_rounds, bool retriangulate, bool final) {
  rounds_at_rest_ = 0;
  constexpr double kMaxChange = 0.0005;
  if (retriangulate) {
    map_->triangulator().CompleteAllTracks(options_.triangulation);
    map_->triangulator().MergeAllTracks(options_.triangulation);
    RetriangulationOptions options;
    options.triangulation = options_.triangulation;
    Retriangulate(options, map_->pairs(), map_.get());
  }
  for (int i = 0; i < max_rounds; ++i) {
    if (AdjustGlobally(GlobalBaOptions(final), nullptr) < kMaxChange) break;
  }
  last_adjusted_ = images_to_maintain_ = map_->reconstruction().RegImageIds();
  MarkCamerasRefined();
  NoteSize();
}

bool Submap::HasGrown() const {
  const colmap::Reconstruction& reconstruction = map_->reconstruction();
  return reconstruction.NumRegImages() >= options_.global_growth * side_.images_at_global ||
         reconstruction.NumPoints3D() >= options_.global_growth * side_.points_at_global;
}

void Submap::NoteSize() {
  side_.images_at_global = map_->reconstruction().NumRegImages();
  side_.points_at_global = map_->reconstruction().NumPoints3D();
}

void Submap::MarkCamerasRefined() {
  for (const auto& [id, state] : map_->camera_states()) {
    if (state.num_registered >= 2) map_->camera_state(id).refined = true;
  }
}

void Submap::RetryDeferred() {
  for (auto& [id, trial] : side_.trials) {
    if (!trial.deferred || trial.rejected || map_->IsRegistered(id)) continue;
    // What proved wrong is tried on new evidence only; for others a refined map is one.
    if (trial.num_withdrawals > 0 && CountVisible(id) <= trial.last_visible) continue;
    Enqueue(id);
  }
}

Status Submap::ReplaceModel(const colmap::Reconstruction& model) {
  DropMaintenance();
  for (const ImageId id : model.RegImageIds()) {
    if (!map_->HasPhoto(id)) return Status::Error("model with an image that is not there");
    if (model.Image(id).NumPoints2D() != map_->reconstruction().Image(id).NumPoints2D()) {
      return Status::Error("model with other keypoints");
    }
    const CameraId camera = model.Image(id).CameraId();
    if (camera != map_->reconstruction().Image(id).CameraId() ||
        model.Camera(camera).ModelId() != map_->reconstruction().Camera(camera).ModelId()) {
      return Status::Error("model with another camera");
    }
  }
  map_->ReplaceRegistered(model);
  is_consolidated_ = false;
  num_pairs_rebuilt_ = 0;
  for (const ImageId id : model.RegImageIds()) {
    queue_.erase(id);
    side_.trials[id].deferred = false;
  }
  MarkCamerasRefined();
  NoteSize();
  return Status::Ok();
}

// A photo that waits may be the one that ties two parts of the map together, and wait because they
// are not yet where it says; so may one that was withdrawn, or rejected, of a map that was bent.
void Submap::RetryAll() {
  for (auto& [id, trial] : side_.trials) {
    if (trial.looks_alike || map_->IsRegistered(id)) continue;
    trial.rejected = false;
    trial.num_withdrawals = 0;
  }
  RetryDeferred();
}

void Submap::Consolidate(const EventSink& sink) {
  Settle(sink);
  Rebuild(sink);
}

void Submap::Settle(const EventSink& sink) {
  constexpr int kMaxRounds = 4;
  for (int round = 0; round < kMaxRounds; ++round) {
    RetryAll();
    while (Step(sink)) continue;
    DropMaintenance();
    if (is_consolidated_ || map_->reconstruction().NumRegImages() < 2) return;
    is_consolidated_ = true;  // until a photo comes or goes
    RefineGlobally(2, true, false);
    WithdrawContradicted(std::vector<ImageId>(map_->reconstruction().RegImageIds()), sink);
    WithdrawMisplaced(sink);
  }
}

void Submap::Finish(const EventSink& sink) {
  Consolidate(sink);
  if (map_->reconstruction().NumRegImages() < 2) return;
  TriangulateAnew(options_.triangulation, map_.get());
  FilterPoints(options_.filter, AllPoints(*map_), map_.get());
  RefineGlobally(5, true, true);
  const std::vector<ImageId> images = map_->reconstruction().RegImageIds();
  WithdrawWeak(images, sink);
}

}  // namespace skein
