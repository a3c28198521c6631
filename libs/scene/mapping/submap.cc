#include "mapping/submap.h"

#include <algorithm>

#include "core/clock.h"
#include "core/log.h"
#include "map/filters.h"
#include "map/image_pose.h"
#include "map/points_anew.h"
#include "mapping/camera_models.h"
#include "mapping/rebuild.h"

namespace skein {
namespace {

// A photo is left to the submap of a visually similar place when that submap observes so many times
// more points of it.
constexpr double kMinYieldRatio = 2.0;

// Whether the model's registered part can replace the map's.
Status CheckFits(const SceneMap& map, const Reconstruction& model) {
  for (const ImageId id : model.RegImageIds()) {
    if (!map.HasPhoto(id)) return NotFound("model with an image that is not there");
    const Image& image = map.reconstruction().Image(id);
    if (model.Image(id).NumPoints2D() != image.NumPoints2D()) {
      return InvalidArgument("model with other keypoints");
    }
    const CameraId camera = model.Image(id).CameraId(), given = map.GivenCamera(id);
    const CameraState& state = map.camera_state(given);
    if ((camera != given && camera != SceneMap::OwnCamera(id)) ||
        (state.known && model.Camera(camera).ModelId() != state.given_model_id)) {
      return InvalidArgument("model with another camera");
    }
  }
  return Status::Ok();
}

std::string FirstCameraModel(const std::string& name) {
  return name == kModelByEvidence ? kFirstModel : name;
}

std::string ToString(const GlobalBaCost& cost) {
  return fmt::format(
      "{} global BAs of {} iterations, {} decompositions, in {:.2f} s, tracks {:.2f} s, "
      "retriangulation {:.2f} s",
      cost.num_rounds, cost.num_iterations, cost.num_decompositions, cost.solve_s, cost.tracks_s,
      cost.retriangulate_s);
}

}  // namespace

Submap::Submap(const SubmapOptions& options)
    : Submap(options, std::make_unique<SceneMap>(FirstCameraModel(options.camera_model))) {}

Submap::Submap(const SubmapOptions& options, std::unique_ptr<SceneMap> map)
    : options_(options),
      map_(std::move(map)),
      waiting_(*map_),
      adjuster_(options_, map_.get()),
      consistency_(options_, *map_, waiting_),
      maintenance_(options_, &adjuster_, map_.get()) {}

Status Submap::AddPairs(int64_t image_id, const TwoViewPairs& pairs) {
  if (!waiting_.IsHeldElsewhere(image_id)) settled_ = {};
  return map_->AddPairs(image_id, pairs);
}

void Submap::SetHeldElsewhere(int64_t image_id, bool held) {
  settled_.all_tried = settled_.consistent = false;
  waiting_.SetHeldElsewhere(image_id, held);
}

InitialPairResult Submap::Start(const InitialPairOptions& options, int64_t image_id1,
                                int64_t image_id2, const EventSink& sink) {
  InitialPairResult result;
  if (!waiting_.MayBeTried(image_id1) || !waiting_.MayBeTried(image_id2) ||
      image_id1 == image_id2) {
    result.status = NotFound("the initial pair is not there");
    return result;
  }
  const double start_s = MonotonicS();
  const ImageId id1 = static_cast<ImageId>(image_id1), id2 = static_cast<ImageId>(image_id2);
  result = RegisterInitialPair(options, id1, id2, map_.get());
  if (!result.status.ok()) return result;
  AdjustGlobally(2, false, false);
  if (map_->reconstruction().Image(id1).NumPoints3D() <
      static_cast<Point2DIdx>(options.min_num_inliers / 2)) {
    map_->Deregister(id1);
    map_->Deregister(id2);
    result.status = FailedPrecondition("too few points after bundle adjustment");
    return result;
  }
  first_ = id1;
  PoseEstimate estimate;
  estimate.num_visible = estimate.num_inliers = result.num_inliers;
  for (const ImageId id : {id1, id2}) {
    PhotoEvent event = RegisteredEvent(id, estimate);
    event.total_s = MonotonicS() - start_s;
    event.num_ba_images = 2;
    sink(event);
    waiting_.Dequeue(id);
    waiting_.EnqueueNeighbours(id);
  }
  return result;
}

bool Submap::Step(const EventSink& sink) {
  Maintain(0, sink);
  const std::optional<ImageId> id = waiting_.TakeNext();
  if (!id) return false;
  if (map_->IsRegistered(*id)) return true;
  const auto part = options_.Enter(SubmapOptions::Part::kPhoto, *id);
  if (TryPhoto(*id, sink)) {
    waiting_.EnqueueNeighbours(*id);
  } else {
    BeginAnewIfSmall(sink);
  }
  return true;
}

// The steps of incremental registration. True if the photo is registered after them.
bool Submap::TryPhoto(ImageId id, const EventSink& sink) {
  PhotoTrial trial(waiting_.ContextOf(id), id, map_.get());
  const bool has_pose = trial.FindPose();
  NoteTried(trial);
  if (!has_pose) {
    Defer(trial, trial.estimate().refusal, sink);
    return false;
  }
  trial.Place();
  const Verdict verdict = trial.Judge();
  if (verdict.decision == Verdict::Decision::kUndo) {
    trial.Undo();
    may_be_misplaced_ |= verdict.refusal.cause == Refusal::Cause::kContradicted;
    Defer(trial, verdict.refusal, sink);
    return false;
  }
  WithdrawForRetry(
      verdict.withdraw,
      {Refusal::Cause::kContradicted, "contradicted by a photo with more agreeing matches"}, sink);
  Keep(trial, sink);
  return map_->IsRegistered(id);
}

void Submap::NoteTried(const PhotoTrial& trial) {
  const PoseEstimate& estimate = trial.estimate();
  waiting_.OnTried(trial.id(), estimate.num_visible);
  may_be_misplaced_ |= estimate.has_too_many_missing_cells;
}

void Submap::Defer(const PhotoTrial& trial, const Refusal& refusal, const EventSink& sink) {
  if (!waiting_.OnDeferred(trial.id())) return;
  PhotoEvent event;
  event.image_id = trial.id();
  event.state = PhotoEvent::State::kDeferred;
  event.refusal = refusal;
  event.num_visible = trial.estimate().num_visible;
  event.num_inliers = trial.estimate().num_inliers;
  event.register_s = trial.register_s();
  event.total_s = trial.total_s();
  sink(event);
}

void Submap::Keep(const PhotoTrial& trial, const EventSink& sink) {
  settled_ = {};
  const double start_s = MonotonicS(), cpu_start_s = ThreadCpuS();
  const int num_images = AdjustNewImage(trial.id());
  map_->ForgetModifiedPoints();
  const double ba_s = MonotonicS() - start_s, ba_cpu_s = ThreadCpuS() - cpu_start_s;
  waiting_.OnRegistered(trial.id());
  const std::vector<ImageId> adjusted = adjuster_.TakeAdjusted();
  PhotoEvent event = RegisteredEvent(trial.id(), trial.estimate());
  event.register_s = trial.register_s();
  event.triangulate_s = trial.triangulate_s();
  event.ba_s = ba_s;
  event.ba_cpu_s = ba_cpu_s;
  event.num_ba_images = num_images;
  event.total_s = trial.total_s();
  sink(event);
  WithdrawWeak(adjusted, sink);
}

int Submap::AdjustNewImage(ImageId new_image) {
  if (adjuster_.IsMapSmall()) {
    const int num_images = static_cast<int>(map_->reconstruction().NumRegImages());
    AdjustGlobally(2, false, false);
    // The error that a lens makes grows with the map.
    if (num_images == options_.max_images_all_global && adjuster_.ChooseIntrinsics()) {
      AdjustGlobally(2, true, false);
    }
    return num_images;
  }
  const int num_images = adjuster_.AdjustLocally(new_image);
  maintenance_.OnLocalBa();
  if (adjuster_.HasMapGrown() && options_.background && is_maintained_) {
    maintenance_.StartGlobalBa();
  } else if (adjuster_.HasMapGrown()) {
    AdjustGlobally(1, true, false);
  }
  return num_images;
}

void Submap::AdjustGlobally(int max_rounds, bool retriangulate, bool final) {
  adjuster_.AdjustGlobally(max_rounds, retriangulate, final);
  maintenance_.OnGlobalBa();
}

bool Submap::Maintain(double idle_s, const EventSink& sink) {
  if (!is_maintained_) return false;
  const auto part = options_.Enter(SubmapOptions::Part::kMaintenance);
  const Maintenance::ToCheck check = maintenance_.DoPart(idle_s);
  WithdrawWeak(check.weak, sink);
  WithdrawContradicted(check.contradicted, sink);
  if (check.all_checked && may_be_misplaced_) WithdrawMisplaced(sink);
  if (check.ba_began) settled_.refined = true;
  if (check.ba_ended && settled_.refined) settled_.shape_known = true;
  settled_.checked |=
      check.all_checked && settled_.refined && !maintenance_.HasWork() && !options_.IsStopped();
  return maintenance_.HasWork();
}

// One after the other: what leaves takes observations of others with it.
void Submap::WithdrawWeak(const std::vector<ImageId>& images, const EventSink& sink) {
  for (const ImageId id : images) {
    if (!map_->IsRegistered(id) || !consistency_.IsWeak(id)) continue;
    Withdraw(
        id,
        {Refusal::Cause::kTooFewCommonPoints, "too few observations left after bundle adjustment"},
        sink);
  }
}

// Where its matches agree on another pose, that is evidence to try the photo again.
void Submap::WithdrawContradicted(const std::vector<ImageId>& images, const EventSink& sink) {
  for (const ImageId id : images) {
    if (options_.IsStopped()) return;
    if (!map_->IsRegistered(id)) continue;
    const Consistency::Contradiction contradiction = consistency_.FindContradiction(id);
    if (!contradiction.exists) continue;
    Withdraw(id,
             {Refusal::Cause::kContradicted,
              "contradicted by most of its matches after bundle adjustment"},
             sink);
    if (contradiction.fits_elsewhere) waiting_.Enqueue(id);
  }
}

// Tried again at once: what contradicts them says where they are.
void Submap::WithdrawForRetry(const std::vector<ImageId>& ids, const Refusal& refusal,
                              const EventSink& sink) {
  for (const ImageId id : ids) Withdraw(id, refusal, sink);
  for (const ImageId id : ids) waiting_.Enqueue(id);
}

// True if there were any.
bool Submap::WithdrawMisplaced(const EventSink& sink) {
  Withdrawal found = consistency_.FindMisplacedPhotos(first_);
  if (found.of_similar_place) {
    for (const ImageId id : found.photos) waiting_.MarkOfSimilarPlace(id);
    for (const ImageId id : consistency_.FindPhotosWithTooManyMissingCells())
      found.photos.push_back(id);
  }
  WithdrawForRetry(found.photos, found.refusal, sink);
  if (!found.photos.empty()) waiting_.RetryDeferred();
  may_be_misplaced_ = false;
  return !found.photos.empty() || WithdrawUntied(sink);
}

// Not tried again at once: nothing says where they are. True if there were any.
bool Submap::WithdrawUntied(const EventSink& sink) {
  const std::vector<ImageId> untied = consistency_.FindUntiedPhotos();
  for (const ImageId id : untied) {
    Withdraw(id,
             {Refusal::Cause::kTooFewCommonPoints, "in a part that too few points tie to the map"},
             sink);
  }
  return !untied.empty();
}

bool Submap::TakeBack(int64_t image_id, const Refusal& refusal, const EventSink& sink) {
  if (!map_->IsRegistered(image_id)) return true;
  const ImageId id = static_cast<ImageId>(image_id);
  if (!Withdraw(id, refusal, sink)) return false;
  waiting_.ForgetVisible(id);
  return true;
}

void Submap::YieldPhotosTo(const Reconstruction& other, const EventSink& sink) {
  const std::vector<ImageId> ids = map_->reconstruction().RegImageIds();
  for (const ImageId id : ids) {
    if (!IsRegisteredIn(other, id)) continue;
    const double there = other.Image(id).NumPoints3D();
    if (there < kMinYieldRatio * map_->reconstruction().Image(id).NumPoints3D()) continue;
    if (Withdraw(
            id,
            {Refusal::Cause::kSimilarPlace, "of a visually similar place that another map holds"},
            sink)) {
      waiting_.MarkOfSimilarPlace(id);
    }
  }
}

bool Submap::Withdraw(ImageId id, const Refusal& refusal, const EventSink& sink) {
  if (map_->reconstruction().NumRegImages() <= 2) return false;
  PhotoEvent event;
  event.image_id = id;
  event.refusal = refusal;
  event.num_inliers = static_cast<int>(map_->reconstruction().Image(id).NumPoints3D());
  map_->Deregister(id);
  maintenance_.OnWithdrawn(id);
  settled_ = {};
  may_be_misplaced_ = true;
  const bool is_rejected = waiting_.OnWithdrawn(id);
  event.state = is_rejected ? PhotoEvent::State::kRejected : PhotoEvent::State::kWithdrawn;
  sink(event);
  return true;
}

Status Submap::ReplaceModel(const Reconstruction& model) {
  maintenance_.Drop();
  const Status status = CheckFits(*map_, model);
  if (!status.ok()) return status;
  map_->ReplaceRegistered(model);
  settled_ = {};
  for (const ImageId id : model.RegImageIds()) waiting_.OnReplaced(id);
  adjuster_.MarkCamerasRefined();
  adjuster_.NoteSize();
  return Status::Ok();
}

void Submap::Consolidate(const EventSink& sink, const Again& again) {
  adjuster_.TakeCost();
  Timer timer;
  RefineUntilStable(sink);
  const double refine_s = timer.ElapsedS();
  const GlobalBaCost cost = adjuster_.TakeCost();
  timer.Restart();
  if (again.is_allowed) MapAsBatch({false, {}, again.absorb}, sink);
  LogInfo("consolidated: {} photos, {} ({:.2f} s), rebuild {:.2f} s",
          map_->reconstruction().NumRegImages(), ToString(cost), refine_s, timer.ElapsedS());
}

// A background adjustment that came to its end spares the first round its bundle adjustment. Photos
// that come and go at each round would have no end: the last round settles the map as well.
void Submap::RefineUntilStable(const EventSink& sink) {
  constexpr int kMaxRounds = 4;
  if (!settled_.all_tried || !settled_.checked) waiting_.RetryAll();
  for (int round = 0; round < kMaxRounds; ++round) {
    TryAllWaiting(sink);
    if (options_.IsStopped()) return;
    maintenance_.Drop();
    if (map_->reconstruction().NumRegImages() < 2) return;
    if (settled_.checked && settled_.intrinsics && settled_.none_misplaced) return;
    if (!settled_.checked) AdjustGlobally(2, true, false);
    if (!options_.IsStopped()) SettleIntrinsics();
    if (options_.IsStopped()) return;
    if (!settled_.checked) {
      settled_.refined = settled_.checked = true;  // until a photo comes or goes
      WithdrawContradicted(std::vector<ImageId>(map_->reconstruction().RegImageIds()), sink);
      WithdrawForRetry(consistency_.FindPhotosWithBetterPose(),
                       {Refusal::Cause::kContradicted, "another pose fits its points better"},
                       sink);
    }
    if (options_.IsStopped()) {
      settled_ = {};
      return;
    }
    settled_.none_misplaced = !WithdrawMisplaced(sink) && settled_.checked;
  }
  settled_.refined = settled_.checked = settled_.none_misplaced = settled_.all_tried = true;
}

// Also of a map that was settled in the background: there they are not chosen.
void Submap::SettleIntrinsics() {
  if (!settled_.intrinsics && adjuster_.ChooseIntrinsics()) {
    AdjustGlobally(2, true, false);
    settled_.checked = settled_.shape_known = false;
  }
  settled_.intrinsics = true;
}

void Submap::TryAllWaiting(const EventSink& sink) {
  if (options_.IsStopped()) return;
  if (!settled_.all_tried || !settled_.checked) waiting_.RetryDeferred();
  while (!options_.IsStopped() && Step(sink)) continue;
  settled_.all_tried = settled_.checked && !options_.IsStopped();
}

// For a small map that a photo could not join: the first pairs of a video, or of cameras with
// unknown focal lengths, often are poor beginnings.
void Submap::BeginAnewIfSmall(const EventSink& sink) {
  Batch batch;
  batch.is_growing = true;
  if (has_larger_neighbour_ || !adjuster_.IsMapSmall() || !MapAsBatch(batch, sink)) return;
  for (const ImageId id : map_->photos()) {
    if (!waiting_.MatchesSimilarPlace(id)) waiting_.Enqueue(id);
  }
}

void Submap::TellNewAndGone(const std::vector<ImageId>& before, const Refusal& refusal,
                            const EventSink& sink) {
  for (const ImageId id : before) {
    if (map_->IsRegistered(id)) continue;
    PhotoEvent event;
    event.image_id = id;
    event.state = PhotoEvent::State::kWithdrawn;
    event.refusal = refusal;
    waiting_.OnDeferred(id);
    sink(event);
  }
  for (const PhotoEvent& event : RegisteredEvents()) {
    const ImageId id = static_cast<ImageId>(event.image_id);
    if (!std::binary_search(before.begin(), before.end(), id)) sink(event);
  }
}

void Submap::Finish(const EventSink& sink, const Again& again) {
  Consolidate(sink, again);
  AdjustWithPointsAnew(sink);
  settled_.consistent = false;
  if (again.is_allowed && MapAsBatch({false, {}, again.absorb}, sink)) AdjustWithPointsAnew(sink);
  if (MayHaveSmallerError() && !options_.IsStopped()) TakeSmallerError(sink);
}

// Without points that the poses can confirm, as of rgbd-scene, zoomed without EXIF, with intrinsics
// of each photo's own, all photos would go: the map that was consolidated is worth more.
void Submap::AdjustWithPointsAnew(const EventSink& sink) {
  if (map_->reconstruction().NumRegImages() < 2 || options_.IsStopped()) return;
  const Reconstruction before = map_->reconstruction();
  Timer timer;
  if (!TriangulateAnew(options_.num_threads, map_.get(), options_.stop)) return;
  FilterPoints(AllPoints(*map_), map_.get());
  const double triangulate_s = timer.ElapsedS();
  timer.Restart();
  AdjustGlobally(5, true, true);
  const int num_unconfirmed = FilterPointsOfTwoPhotos(map_.get());
  const std::vector<ImageId> registered = map_->reconstruction().RegImageIds();
  const auto num_weak = std::count_if(registered.begin(), registered.end(),
                                      [this](ImageId id) { return consistency_.IsWeak(id); });
  const bool has_collapsed = 2 * num_weak > static_cast<std::ptrdiff_t>(registered.size());
  if (has_collapsed) {
    LogWarn("final model: {} of {} photos would have too few observations; the map stays as it was",
            num_weak, registered.size());
    map_->ReplaceRegistered(before);
  } else {
    WithdrawWeak(registered, sink);
  }
  if (!options_.IsStopped()) adjuster_.Check(settled_.shape_known && !has_collapsed);
  const GlobalBaCost cost = adjuster_.TakeCost();
  LogInfo("final model: points anew {:.2f} s, {} ({:.2f} s), {} points of two photos removed",
          triangulate_s, ToString(cost), timer.ElapsedS(), num_unconfirmed);
}

}  // namespace skein
