#include "merger/merger_service.h"

#include <algorithm>
#include <random>
#include <utility>

#include "core/counted.h"
#include "core/log.h"
#include "event_loop/step_record.h"
#include "ledger/fact_ids.h"
#include "merger/messages.h"
#include "merging/absorb.h"
#include "merging/shared_views.h"
#include "session/places.h"

namespace skein {
namespace {

constexpr double kDecidePeriodS = 0.1;
constexpr char kStep[] = "similarity";
constexpr double kRequestPeriodS = 0.5;  // of an unanswered request for shared images
constexpr double kRequestTimeoutS = 20;  // then the attempt is given up, and made again
constexpr double kIdleMapperS = 3;       // a mapper that asked for work within this is idle
constexpr double kHoldAfterRefusalS = 1;
// A finish waits so long for a mapper that could take a seed. A mapper offers to share within 8 s
// (mapper/submap_sharing.h), and a pool starts one within as long.
constexpr double kWaitForMapperS = 15;

// Requests of a merger that ran before must not be taken for ours.
int64_t RandomRequestId() {
  std::random_device device;
  return (static_cast<int64_t>(device()) << 20) + 1;
}

// The same photos, with the source for the target and the reverse.
std::vector<SharedPhoto> Reversed(std::vector<SharedPhoto> shared) {
  for (SharedPhoto& photo : shared) {
    std::swap(photo.source_camera, photo.target_camera);
    std::swap(photo.cam_from_source, photo.cam_from_target);
    for (auto& point : photo.points) std::swap(point.source_xyz, point.target_xyz);
  }
  return shared;
}

// The reverse way only where the first finds none.
Sim3Result EstimateBothWays(std::vector<SharedPhoto> shared, const Sim3Options& options) {
  Sim3Result result = EstimateSim3(shared, options);
  if (result.success) return result;
  Sim3Result reverse = EstimateSim3(Reversed(std::move(shared)), options);
  if (!reverse.success) return result;
  reverse.target_from_source = reverse.target_from_source.Inverse();
  return reverse;
}

struct Estimated {
  Sim3Options options;
  Sim3Result result;
};

// From what the mappers sent. When nothing more can come, the photos that both could place are
// enough if they agree well.
Estimated EstimateFrom(const Bytes& source_blob, const Bytes& target_blob, bool finishing,
                       const Sim3Options& options) {
  Estimated estimated{options, {}};
  const Result<SharedImages> source = DecodeSharedImages(source_blob);
  const Result<SharedImages> target = DecodeSharedImages(target_blob);
  if (!source.ok() || !target.ok()) {
    estimated.result.reason =
        "bad shared images: " + (source.ok() ? target.error() : source.error());
    return estimated;
  }
  std::vector<SharedPhoto> shared = PairSharedViews(ViewsOf(*source), ViewsOf(*target));
  const int num_both = static_cast<int>(shared.size());
  if (finishing) AdaptToFewImages(std::max(1, num_both), &estimated.options);
  estimated.result = EstimateBothWays(std::move(shared), estimated.options);
  return estimated;
}

// An exception fails the attempt, which is made again with more evidence.
Estimated TryToEstimate(StepRecord* steps, int64_t source_id, const Bytes& source_blob,
                        const Bytes& target_blob, bool finishing, const Sim3Options& options) {
  Result<Estimated> estimated = AttemptStep(steps, 0, {source_id, kStep}, [&] {
    return EstimateFrom(source_blob, target_blob, finishing, options);
  });
  if (estimated.ok()) return *std::move(estimated);
  Estimated failed{options, {}};
  failed.result.reason = ClampText(estimated.error());
  return failed;
}

}  // namespace

MergerService::MergerService(Node& node, const MergerOptions& options)
    : node_(node),
      options_(options),
      mappers_wanted_(node, "submap"),
      merges_(options.merge),
      active_s_(node.loop().now_s()),
      next_request_id_(RandomRequestId()),
      worker_(node.loop()) {
  Bus& bus = node_.bus();
  subscriptions_ = {
      bus.Subscribe<submap_status_t>(kSubmapStatusChannel, [this](const auto& m) { OnStatus(m); }),
      bus.Subscribe<ledger_head_t>(kLedgerHeadChannel, [this](const auto& m) { OnHead(m); }),
      bus.Subscribe<work_request_t>(kWorkRequestChannel,
                                    [this](const auto& m) { OnWorkRequest(m); }),
      bus.Subscribe<shared_reply_t>(kSharedReplyChannel,
                                    [this](const auto& m) { OnSharedReply(m); })};
  follower_ =
      std::make_unique<LedgerFollower>(node_, 1, [this](const Fact& fact) { OnFact(fact); });
  timer_ = node_.loop().AddTimer(kDecidePeriodS, [this] { Decide(); });
  node_.OnHeartbeat([this](heartbeat_t* heartbeat) {
    heartbeat->state = wants_mapper_s_ > 0 ? "a seed waits for an idle mapper"
                       : estimate_         ? "estimating a similarity"
                                           : Counted(directory_.Live().size(), "map");
    heartbeat->backlog = directory_.NumOpenMerges();
    heartbeat->num_done = num_merged_;
  });
}

MergerService::~MergerService() {
  for (const auto id : subscriptions_) node_.bus().Unsubscribe(id);
  node_.loop().CancelTimer(timer_);
}

void MergerService::OnFact(const Fact& fact) {
  session_.Apply(fact);
  std::visit([this](const auto& f) { React(f); }, fact);
}

void MergerService::NoteActivity() { active_s_ = node_.loop().now_s(); }

void MergerService::React(const registration_t& registration) {
  if (registration.state == registration_t::REGISTERED) NoteActivity();
  // What one submap turns down or gives up, another may take.
  if (IsFinishing()) settle_seq_ = registration.header.seq;
}

void MergerService::React(const submap_lease_t& lease) {
  idle_mappers_.erase(lease.owner);
  settle_seq_ = lease.header.seq;
}

void MergerService::React(const merge_t& merge) {
  settle_seq_ = merge.header.seq;
  if (merge.state == merge_t::DONE) {
    ++num_merged_;
    evidence_.OnMerged(merge.source_id, merge.target_id);
    LogInfo("submap {} is part of submap {} now, {:.1f} s after they could be compared",
            merge.source_id, merge.target_id,
            static_cast<double>(merge.header.utime_us - merge.evidence_utime_us) * 1e-6);
  } else if (merge.state == merge_t::UNDONE) {
    LogInfo("submaps {} and {} stay apart: {}", merge.source_id, merge.target_id, merge.reason);
  }
}

void MergerService::React(const finish_t& finish) {
  const bool is_worked_on = finish.state == finish_t::DRAINED || finish.state == finish_t::BATCH;
  if (is_worked_on) settle_seq_ = finish.header.seq;
}

void MergerService::OnStatus(const submap_status_t& status) {
  SubmapDirectory::Position& heard = heard_statuses_[status.submap_id];
  if (status.epoch < heard.epoch) return;
  heard = {status.epoch, status.ledger_seq};
}

// What a mapper submitted before its status is committed, but may not have reached us. Once the
// ledger is read up to a head that was told after the status, it has.
void MergerService::OnHead(const ledger_head_t& head) {
  if (head.in_flight > 0) NoteActivity();
  if (follower_->processed_seq() >= head.head_seq) {
    for (const auto& [submap_id, status] : new_statuses_) {
      directory_.OnStatus(submap_id, status.epoch, status.ledger_seq);
    }
    new_statuses_.clear();
  }
  heard_statuses_.merge(new_statuses_);  // the newer ones stay
  new_statuses_ = std::exchange(heard_statuses_, {});
}

void MergerService::OnWorkRequest(const work_request_t& request) {
  if (request.kind != "submap") return;
  if (request.capacity > 0) {
    idle_mappers_[request.worker] = node_.loop().now_s();
  } else {
    idle_mappers_.erase(request.worker);
  }
}

int MergerService::NumIdleMappers() const {
  const double now_s = node_.loop().now_s();
  int num_idle = 0;
  for (const auto& [worker, asked_s] : idle_mappers_) {
    num_idle += now_s - asked_s <= kIdleMapperS;
  }
  for (const LiveSubmap& submap : directory_.Live()) {
    num_idle -= submap.state->lease.epoch == 0;
  }
  return num_idle;
}

bool MergerService::MayDecide() const {
  const bool settled = session_.finish().state == finish_t::SETTLED;
  return follower_->caught_up() && follower_->processed_seq() >= await_seq_ &&
         node_.submitter().pending() == 0 && node_.loop().now_s() >= hold_until_s_ && !settled;
}

void MergerService::Decide() {
  if (estimate_ && EstimateIsStale()) estimate_.reset();
  if (estimate_) AskForShared();
  if (!MayDecide()) return;
  evidence_.Note(directory_.FindOverlaps(), session_.last_utime_us());
  if (!estimate_ && IsFinishing() && TryBatch()) return;
  if (TrySeed() || estimate_) return;
  // A submap that still works may win and lose photos.
  if (IsFinishing() && !EverySubmapWorkedUpTo(settle_seq_)) return;
  TryMerge();
  if (!estimate_ && IsFinishing()) TrySettle();
}

bool MergerService::TrySeed() {
  const SeedSituation situation{node_.loop().now_s() - active_s_, IsFinishing(),
                                follower_->processed_seq()};
  const std::optional<SeedChoice> choice = seeds_.Choose(directory_, situation);
  if (!choice) {
    WantMapper(false);
    return false;
  }
  WantMapper(NumIdleMappers() <= 0);
  if (wants_mapper_s_ > 0) return false;
  LogInfo("seed: photos {} and {}, {} inliers, {:.1f} degrees", choice->image_id1,
          choice->image_id2, choice->num_inliers, choice->tri_angle_rad * 57.29578);
  Submit(SeedMessage(*choice), [this, choice](bool committed) {
    if (!committed) seeds_.OnRefused(choice->image_id1, choice->image_id2);
  });
  return true;
}

// Heard by mapper pools: they grow for it.
void MergerService::WantMapper(bool wanted) {
  if (!wanted) wants_mapper_s_ = 0;
  if (wanted && wants_mapper_s_ == 0) wants_mapper_s_ = node_.loop().now_s();
  mappers_wanted_.Set(wanted ? 1 : 0);
}

void MergerService::TryMerge() {
  std::optional<MergeAttempt> attempt = merges_.Next(directory_, IsFinishing());
  if (!attempt) return;
  estimate_ = std::make_unique<Estimate>();
  estimate_->attempt = std::move(*attempt);
  estimate_->request_id = next_request_id_++;
  estimate_->started_s = node_.loop().now_s();
  AskForShared();
}

bool MergerService::EverySubmapWorkedUpTo(int64_t seq) const {
  const auto live = directory_.Live();
  return std::all_of(live.begin(), live.end(), [seq](const LiveSubmap& submap) {
    return submap.state->lease.epoch > 0 && submap.ledger_seq >= seq;
  });
}

void MergerService::TrySettle() {
  if (directory_.NumOpenMerges() > 0) return;
  if (merges_.Next(directory_, true)) return;
  const bool waits_for_mapper =
      wants_mapper_s_ > 0 && node_.loop().now_s() - wants_mapper_s_ < kWaitForMapperS;
  if (waits_for_mapper) return;
  if (wants_mapper_s_ > 0) LogWarn("finishing without a submap that no mapper is idle for");
  SubmitFinish(finish_t::SETTLED);
}

// Once a finish, and before what may need many merges is merged: one map of a place by all its
// pairs at once makes most of them needless. True while it is waited for.
bool MergerService::TryBatch() {
  const FinishState& finish = session_.finish();
  if (!merges_.is_enabled() || finish.batch_seq != 0 || finish.is_cut()) return false;
  if (!HasDividedPlace(FindPlaces(session_))) return false;
  if (directory_.NumOpenMerges() == 0 && EverySubmapWorkedUpTo(settle_seq_))
    SubmitFinish(finish_t::BATCH);
  return true;
}

void MergerService::SubmitFinish(int8_t state) {
  finish_t fact{};
  fact.finish_id = session_.finish().finish_id;
  fact.state = state;
  fact.header.fact_id = FinishFactId(fact.finish_id, state);
  Submit(fact, [](bool) {});
}

bool MergerService::EstimateIsStale() const {
  if (estimate_->computing) return false;
  const MergeAttempt& attempt = estimate_->attempt;
  for (const int64_t submap_id : {attempt.source_id, attempt.target_id}) {
    if (!session_.IsLive(submap_id) || directory_.IsBusy(submap_id)) return true;
  }
  return node_.loop().now_s() - estimate_->started_s > kRequestTimeoutS;
}

void MergerService::AskForShared() {
  const double now_s = node_.loop().now_s();
  if (estimate_->computing || now_s - estimate_->asked_s < kRequestPeriodS) return;
  estimate_->asked_s = now_s;
  const MergeAttempt& attempt = estimate_->attempt;
  for (const int64_t submap_id : {attempt.source_id, attempt.target_id}) {
    if (estimate_->fetching.count(submap_id)) continue;
    shared_request_t request{};
    request.request_id = estimate_->request_id;
    request.submap_id = submap_id;
    request.other_submap_id =
        submap_id == attempt.source_id ? attempt.target_id : attempt.source_id;
    request.image_ids = attempt.images;
    request.num_images = static_cast<int32_t>(request.image_ids.size());
    node_.Publish(kSharedRequestChannel, request);
  }
}

void MergerService::OnSharedReply(const shared_reply_t& reply) {
  if (!estimate_ || reply.request_id != estimate_->request_id) return;
  const SubmapLife* submap = session_.FindSubmap(reply.submap_id);
  if (submap == nullptr || reply.epoch != submap->lease.epoch) return;
  if (!estimate_->fetching.emplace(reply.submap_id, reply.blob_id).second) return;
  node_.blobs().Fetch(reply.blob_id, reply.owner,
                      [this, id = reply.submap_id, request = reply.request_id](Result<Bytes> blob) {
                        OnSharedBlob(id, request, std::move(blob));
                      });
}

void MergerService::OnSharedBlob(int64_t submap_id, int64_t request_id, Result<Bytes> blob) {
  if (!estimate_ || request_id != estimate_->request_id) return;
  if (!blob.ok()) {
    estimate_->fetching.erase(submap_id);
    return;
  }
  estimate_->blobs.emplace(submap_id, std::move(blob));
  if (estimate_->blobs.size() == 2) ComputeEstimate();
}

void MergerService::ComputeEstimate() {
  estimate_->computing = true;
  const MergeAttempt attempt = estimate_->attempt;
  Bytes source = std::move(*estimate_->blobs.at(attempt.source_id));
  Bytes target = std::move(*estimate_->blobs.at(attempt.target_id));
  Sim3Options options;
  options.seed = static_cast<uint64_t>(attempt.source_id * 1000003 + attempt.target_id);
  const double started_s = estimate_->started_s;
  const bool finishing = IsFinishing();
  worker_.Run([&steps = node_.steps(), id = attempt.source_id, source = std::move(source),
               target = std::move(target), finishing,
               options] { return TryToEstimate(&steps, id, source, target, finishing, options); },
              [=](const Estimated& estimated) {
                OnEstimated(attempt, estimated.options, estimated.result,
                            node_.loop().now_s() - started_s);
              });
}

void MergerService::OnEstimated(MergeAttempt attempt, const Sim3Options& options, Sim3Result result,
                                double duration_s) {
  estimate_.reset();
  for (const int64_t submap_id : {attempt.source_id, attempt.target_id}) {
    if (!session_.IsLive(submap_id) || directory_.IsBusy(submap_id)) return;
  }
  LogInfo("similarity of submaps {} and {} from {} photos of both: {}", attempt.source_id,
          attempt.target_id, attempt.num_images, result.success ? "found" : result.reason);
  if (result.success && merges_.IsBetterReversed(attempt, result.inlier_image_ids, directory_)) {
    std::swap(attempt.source_id, attempt.target_id);
    result.target_from_source = result.target_from_source.Inverse();
  }
  Submit(AttemptMessage(attempt, session_, result, options, duration_s, EvidenceUtimeOf(attempt)),
         [](bool) {});
}

// A finish tries pairs with less than what counts as evidence.
int64_t MergerService::EvidenceUtimeOf(const MergeAttempt& attempt) const {
  const int64_t utime_us = evidence_.UtimeOf(attempt.source_id, attempt.target_id);
  return utime_us > 0 ? utime_us : session_.last_utime_us();
}

void MergerService::Submit(Fact fact, std::function<void(bool committed)> then) {
  Header(fact).computed_at_seq = follower_->processed_seq();
  const std::string fact_id = Header(fact).fact_id;
  node_.submitter().Submit(std::move(fact), [=](const Submission& done) {
    if (done.committed()) {
      await_seq_ = std::max(await_seq_, done.seq);
    } else {
      // The ledger moved on meanwhile; what it says now is looked at again in a while.
      LogWarn("{} was refused: {}", fact_id, done.reason);
      hold_until_s_ = node_.loop().now_s() + kHoldAfterRefusalS;
    }
    then(done.committed());
  });
}

}  // namespace skein
