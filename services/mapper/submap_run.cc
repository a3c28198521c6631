#include "mapper/submap_run.h"

#include <algorithm>
#include <utility>

#include "core/clock.h"
#include "core/log.h"
#include "core/process.h"
#include "mapper/messages.h"
#include "mapping/checkpoint.h"

namespace skein {
namespace {

constexpr double kStatisticsPeriodS = 1.0;
// After this long without a photo the map is at rest and converges.
constexpr double kRestS = 4.0;
constexpr double kMaintenancePeriodS = 0.1;

InitialPairOptions OptionsOfSeed(const seed_t& seed) {
  // The merger has chosen the pair; what it measured is not held to more than a half here, as the
  // relative pose is estimated anew.
  InitialPairOptions options;
  options.min_num_inliers = std::clamp(seed.num_inliers / 2, 30, options.min_num_inliers);
  options.min_triangulation_angle_deg =
      std::min(options.min_triangulation_angle_deg, 0.5 * seed.tri_angle_rad * 180.0 / M_PI);
  return options;
}

void AddToSubmap(const LoadedPhoto& photo, Submap* submap) {
  const int64_t id = photo.input.image_id;
  for (const Status& status : {submap->AddPhoto(photo.input), submap->AddPairs(id, photo.pairs)}) {
    if (!status.ok()) LogWarn("photo {}: {}", id, status.error());
  }
  submap->AddSimilar(id, photo.distances);
}

}  // namespace

SubmapRun::SubmapRun(Node& node, const LedgerIndex& index, const LedgerFollower& follower,
                     MapperThreads threads, const SubmapRunOptions& options, MergeHandler* merges,
                     int64_t submap_id, int64_t epoch, OnEnd on_end)
    : node_(node),
      index_(index),
      follower_(follower),
      threads_(threads),
      options_(options),
      merges_(merges),
      submap_id_(submap_id),
      epoch_(epoch),
      on_end_(std::move(on_end)),
      submap_(std::make_shared<Submap>(options.submap)),
      statistics_(std::make_shared<SubmapStatistics>()),
      loader_(node.blobs(), index),
      checkpoint_s_(MonotonicS()) {
  Pump();
}

SubmapRun::~SubmapRun() {
  if (merges_ != nullptr) merges_->OnRunGone();
}

int SubmapRun::backlog() const {
  return static_cast<int>(index_.items().size() - std::min(cursor_, index_.items().size()) +
                          wanted_.size());
}

void SubmapRun::OnFact(const Fact& fact) {
  if (ended_) return;
  const submap_t* lease = index_.FindLease(submap_id_);
  if (lease != nullptr && lease->epoch > epoch_)
    return End(EndKind::kOver, "the lease went to " + lease->owner);
  if (index_.HasEnded(submap_id_)) return End(EndKind::kOver, "the submap has ended");
  const auto* merge = std::get_if<merge_t>(&fact);
  if (merge != nullptr && merge->state != merge_t::ORDERED && merges_ != nullptr && working_) {
    merges_->OnMergeFact(*merge, *this);
  }
  Pump();
}

// The next thing to do, if nothing is under way.
void SubmapRun::Pump() {
  if (ended_ || busy_) return;
  if (!begun_) return Begin();
  if (!working_) return;
  if (!refused_.empty()) return TakeBackRefused();
  if (!wanted_.empty()) return LoadWanted();
  if (more_) {
    return RunJob(
        [](Submap& submap, Outcome* outcome) {
          outcome->more =
              submap.Step([outcome](const PhotoEvent& event) { outcome->events.push_back(event); });
        },
        [this](const Outcome& outcome) { OnOutcome(outcome); });
  }
  item_open_ = false;
  NoteLostPhotos();
  if (FinalIsDue()) return WriteModel(submap_t::FINAL, cursor_seq_, [] {});
  if (CheckpointIsDue()) return WriteModel(submap_t::CHECKPOINT, cursor_seq_, [] {});
  if (cursor_ < index_.items().size()) {
    const Item item = index_.items()[cursor_++];
    cursor_seq_ = item.seq;
    item_open_ = true;
    status_due_ = true;
    return DoItem(item);
  }
  cursor_seq_ = std::max(cursor_seq_, follower_.processed_seq());
  if (std::exchange(status_due_, false)) PublishStatus();
}

void SubmapRun::Begin() {
  // The lease's fact comes after all that earlier epochs have committed.
  const submap_t* lease = index_.FindLease(submap_id_);
  if (lease == nullptr || lease->epoch < epoch_) return;
  const seed_t* seed = index_.FindSeed(submap_id_);
  const submap_t* model = index_.FindModel(submap_id_);
  if (seed == nullptr && model == nullptr) return;
  begun_ = true;
  lost_check_seq_ = follower_.processed_seq();
  if (model != nullptr) return BeginFromModel(*model);
  BeginFromSeed(*seed);
}

void SubmapRun::BeginFromSeed(const seed_t& seed) {
  busy_ = true;
  const int64_t seq = seed.header.seq;
  AddPhotos({seed.image_id1, seed.image_id2}, [this, seed, seq](const Status& status) {
    if (!status.ok()) return Dissolve("initial pair: " + status.error());
    RunJob(
        [seed](Submap& submap, Outcome* outcome) {
          const InitialPairResult result = submap.Start(
              OptionsOfSeed(seed), seed.image_id1, seed.image_id2,
              [outcome](const PhotoEvent& event) { outcome->events.push_back(event); });
          if (!result.ok) outcome->error = "initial pair: " + result.reason;
          outcome->more = true;
        },
        [this, seq](const Outcome& outcome) {
          if (!outcome.error.empty()) return Dissolve(outcome.error);
          StartWorking(seq);
          OnOutcome(outcome);
        });
  });
}

void SubmapRun::BeginFromModel(const submap_t& model) {
  busy_ = true;
  LogInfo("submap {} goes on from seq {}", submap_id_, model.ledger_seq);
  std::weak_ptr<bool> alive = alive_;
  const int64_t ledger_seq = model.ledger_seq;
  node_.blobs().Fetch(model.model_blob, "ingest", [this, alive, ledger_seq](Result<Bytes> bytes) {
    if (alive.expired()) return;
    Result<ModelArchive> archive =
        bytes.ok() ? DecodeModelArchive(*bytes) : Result<ModelArchive>(bytes.status());
    if (!archive.ok()) return End(EndKind::kFailed, "checkpoint: " + archive.error());
    Restore(std::make_shared<const ModelArchive>(std::move(*archive)), ledger_seq);
  });
}

void SubmapRun::Restore(std::shared_ptr<const ModelArchive> archive, int64_t ledger_seq) {
  const Result<std::vector<int64_t>> photos = PhotosOfArchive(*archive);
  if (!photos.ok()) return End(EndKind::kFailed, "checkpoint: " + photos.error());
  AddPhotos(*photos, [this, archive, ledger_seq](const Status& status) {
    if (!status.ok()) return End(EndKind::kFailed, "checkpoint: " + status.error());
    RunJob(
        [archive](Submap& submap, Outcome* outcome) {
          const Status restored = RestoreSubmap(*archive, &submap);
          if (!restored.ok()) outcome->error = restored.error();
          outcome->events = submap.RegisteredEvents();
        },
        [this, ledger_seq](const Outcome& outcome) { OnRestored(outcome, ledger_seq); });
  });
}

// Photos that the checkpoint holds are told only where the ledger does not know of them.
void SubmapRun::OnRestored(const Outcome& outcome, int64_t ledger_seq) {
  if (!outcome.error.empty()) return End(EndKind::kFailed, "checkpoint: " + outcome.error);
  StartWorking(ledger_seq);
  const std::vector<int64_t> known = index_.RegisteredIn(submap_id_);
  std::vector<PhotoEvent> unknown;
  for (const PhotoEvent& event : outcome.events) {
    registered_.insert(event.image_id);
    if (!std::binary_search(known.begin(), known.end(), event.image_id)) unknown.push_back(event);
  }
  Report(unknown);
  for (const PhotoEvent& event : outcome.events) WantNeighboursOf(event.image_id);
  Pump();
}

void SubmapRun::StartWorking(int64_t seq) {
  working_ = true;
  cursor_seq_ = seq;
  item_open_ = true;
  const auto& items = index_.items();
  cursor_ = std::upper_bound(items.begin(), items.end(), seq,
                             [](int64_t s, const Item& item) { return s < item.seq; }) -
            items.begin();
}

void SubmapRun::AddPhotos(const std::vector<int64_t>& image_ids, std::function<void(Status)> then) {
  struct Batch {
    std::vector<Result<LoadedPhoto>> photos;
    size_t num_missing;
  };
  auto batch = std::make_shared<Batch>();
  std::vector<int64_t> missing;
  for (const int64_t id : image_ids) {
    if (present_.insert(id).second) missing.push_back(id);
  }
  batch->photos.resize(missing.size(), Status::Error("not loaded"));
  batch->num_missing = missing.size();
  const auto add = [this, batch, then] {
    auto error = std::make_shared<std::string>();
    RunOnSubmap(
        [batch, error](Submap& submap) {
          for (const Result<LoadedPhoto>& photo : batch->photos) {
            if (photo.ok()) {
              AddToSubmap(*photo, &submap);
            } else {
              *error = photo.error();
            }
          }
        },
        [then, error] { then(error->empty() ? Status::Ok() : Status::Error(*error)); });
  };
  if (missing.empty()) return add();
  for (size_t i = 0; i < missing.size(); ++i) {
    loader_.Load(missing[i], [batch, i, add](Result<LoadedPhoto> photo) {
      batch->photos[i] = std::move(photo);
      if (--batch->num_missing == 0) add();
    });
  }
}

void SubmapRun::LoadWanted() {
  busy_ = true;
  const std::vector<int64_t> ids(wanted_.begin(), wanted_.end());
  wanted_.clear();
  AddPhotos(ids, [this, ids](const Status& status) {
    if (!status.ok()) LogWarn("submap {}: {}", submap_id_, status.error());
    RunJob(
        [ids](Submap& submap, Outcome* outcome) {
          for (const int64_t id : ids) submap.Enqueue(id);
          outcome->more = true;
        },
        [this](const Outcome& outcome) { OnOutcome(outcome); });
  });
}

void SubmapRun::DoItem(const Item& item) {
  switch (item.kind) {
    case Item::Kind::kMatches:
      return DoMatches(item.id);
    case Item::Kind::kDrained:
      is_drained_ = true;
      return Consolidate();
    case Item::Kind::kSettled:
      return DoSettled(item);
    case Item::Kind::kMerge:
      return DoMerge(item);
  }
}

void SubmapRun::Consolidate() {
  RunJob(
      [](Submap& submap, Outcome* outcome) {
        submap.Consolidate(
            [outcome](const PhotoEvent& event) { outcome->events.push_back(event); });
      },
      [this](const Outcome& outcome) { OnOutcome(outcome); });
}

// A photo is the submap's business when it has a verified pair with a registered one.
void SubmapRun::DoMatches(int64_t image_id) {
  for (const auto& [other, seq] : index_.Neighbours(image_id)) {
    if (seq > cursor_seq_ || registered_.count(other) == 0) continue;
    wanted_.insert(image_id);
    break;
  }
  Pump();
}

void SubmapRun::DoSettled(const Item& item) {
  const submap_t* model = index_.FindModel(submap_id_);
  const bool done =
      model != nullptr && model->state == submap_t::FINAL && model->ledger_seq >= item.seq;
  is_drained_ = false;
  if (done) return Pump();
  RunJob(
      [](Submap& submap, Outcome* outcome) {
        submap.Finish([outcome](const PhotoEvent& event) { outcome->events.push_back(event); });
      },
      [this](const Outcome& outcome) {
        Report(outcome.events);
        statistics_due_s_ = 0;
        final_due_s_ = 0;
        Pump();
      });
}

void SubmapRun::DoMerge(const Item& item) {
  const std::vector<merge_t>& facts = index_.FindMerge(item.id);
  const merge_t& ordered = facts.front();
  const bool ours = ordered.source_id == submap_id_ || ordered.target_id == submap_id_;
  const bool undone = facts.back().state == merge_t::UNDONE;
  if (!ours || undone || merges_ == nullptr) return Pump();
  busy_ = true;
  merging_ = ordered;
  PublishStatus();
  std::weak_ptr<bool> alive = alive_;
  merges_->OnOrdered(ordered, *this, [this, alive] {
    if (alive.expired()) return;
    busy_ = false;
    merging_.reset();
    more_ = true;
    if (is_drained_) return Consolidate();
    Pump();
  });
}

void SubmapRun::RunOnSubmap(std::function<void(Submap&)> job, std::function<void()> then) {
  std::weak_ptr<bool> alive = alive_;
  threads_.worker.Run([submap = submap_, job = std::move(job)] { job(*submap); },
                      [alive, then = std::move(then)] {
                        if (!alive.expired()) then();
                      });
}

void SubmapRun::RunJob(std::function<void(Submap&, Outcome*)> job,
                       std::function<void(const Outcome&)> then) {
  busy_ = true;
  auto outcome = std::make_shared<Outcome>();
  const bool count = MonotonicS() >= statistics_due_s_;
  auto count_s = std::make_shared<double>(0);
  auto counted = std::make_shared<SubmapStatistics>(*statistics_);
  RunOnSubmap(
      [job = std::move(job), outcome, counted, count, count_s](Submap& submap) {
        job(submap, outcome.get());
        const double start = MonotonicS();
        if (count) *counted = submap.Statistics();
        *count_s = MonotonicS() - start;
      },
      [this, outcome, counted, count, count_s, then = std::move(then)] {
        busy_ = false;
        // They visit all points: at most a hundredth of the time.
        if (count) {
          statistics_due_s_ = MonotonicS() + std::max(kStatisticsPeriodS, 100.0 * *count_s);
        }
        statistics_ = counted;
        then(*outcome);
      });
}

void SubmapRun::OnOutcome(const Outcome& outcome) {
  more_ = outcome.more;
  if (!outcome.events.empty()) {
    maintaining_ = true;
    last_event_s_ = MonotonicS();
  }
  Report(outcome.events);
  for (const PhotoEvent& event : outcome.events) {
    if (registered_.count(event.image_id) > 0) WantNeighboursOf(event.image_id);
  }
  if (!outcome.events.empty()) PublishStatus();
  Pump();
}

void SubmapRun::WantNeighboursOf(int64_t image_id) {
  for (const auto& [other, seq] : index_.Neighbours(image_id)) {
    if (seq <= cursor_seq_ && present_.count(other) == 0) wanted_.insert(other);
  }
}

void SubmapRun::Report(const std::vector<PhotoEvent>& events) {
  for (const PhotoEvent& event : events) {
    if (event.state == PhotoEvent::State::kRegistered) {
      registered_.insert(event.image_id);
    } else {
      registered_.erase(event.image_id);
    }
    ++num_changes_;
    registration_t fact = ToMessage(event, submap_id_, epoch_);
    fact.header.fact_id =
        RegistrationFactId(event.image_id, submap_id_, epoch_, ++num_facts_[event.image_id]);
    Submit(
        fact, [](int64_t) {},
        [this, event](const std::string& reason) { OnReportRefused(event, reason); });
  }
}

// A photo that the ledger does not take must not stay in the map: nobody would know of it. Of the
// others the ledger goes on holding what it held.
void SubmapRun::OnReportRefused(const PhotoEvent& event, const std::string& reason) {
  if (event.state != PhotoEvent::State::kRegistered) return;
  refused_[event.image_id] = "refused by the ledger: " + reason;
  Pump();
}

void SubmapRun::TakeBackRefused() {
  RunJob(
      [refused = std::exchange(refused_, {})](Submap& submap, Outcome* outcome) {
        const auto sink = [outcome](const PhotoEvent& event) { outcome->events.push_back(event); };
        for (const auto& [id, reason] : refused) {
          if (!submap.TakeBack(id, reason, sink)) outcome->error = reason;
        }
        outcome->more = true;
      },
      [this](const Outcome& outcome) {
        if (!outcome.error.empty()) return Dissolve("initial pair: " + outcome.error);
        OnOutcome(outcome);
      });
}

// What the ledger holds for registered by an earlier epoch, and is not so after the replay of all
// that that epoch can have seen.
void SubmapRun::NoteLostPhotos() {
  const bool replayed =
      cursor_ >= index_.items().size() || index_.items()[cursor_].seq > lost_check_seq_;
  if (lost_check_seq_ == 0 || !replayed) return;
  lost_check_seq_ = 0;
  std::vector<PhotoEvent> lost;
  for (const int64_t id : index_.RegisteredIn(submap_id_)) {
    if (registered_.count(id) > 0) continue;
    PhotoEvent event;
    event.image_id = id;
    event.state = PhotoEvent::State::kWithdrawn;
    event.reason = "not registered again after the submap changed hands";
    lost.push_back(event);
  }
  Report(lost);
}

void SubmapRun::Submit(Fact fact, std::function<void(int64_t seq)> then, OnRefused refused) {
  std::weak_ptr<bool> alive = alive_;
  const int64_t at = cursor_seq_;
  Header(fact).computed_at_seq = at;
  uncommitted_.insert(at);
  const auto decided = [this, alive, at, id = Header(fact).fact_id, then = std::move(then),
                        refused = std::move(refused)](const Submission& done) {
    if (alive.expired()) return;
    const auto it = uncommitted_.find(at);
    if (it != uncommitted_.end()) uncommitted_.erase(it);
    if (done.state == Submission::State::kNotLeased) return End(EndKind::kOver, done.reason);
    if (!done.committed()) LogWarn("submap {}: {} refused: {}", submap_id_, id, done.reason);
    done.committed() ? then(done.seq) : refused(done.reason);
    if (!uncommitted_.empty()) return;
    PublishStatus();
    for (const auto& next : std::exchange(when_committed_, {})) next();
    Pump();
  };
  node_.submitter().Submit(std::move(fact), decided);
}

void SubmapRun::WhenCommitted(std::function<void()> then) {
  if (uncommitted_.empty()) return then();
  when_committed_.push_back(std::move(then));
}

void SubmapRun::TakeOver(const std::vector<PhotoEvent>& events) {
  Report(events);
  for (const PhotoEvent& event : events) WantNeighboursOf(event.image_id);
  checkpoint_s_ = 0;
}

int64_t SubmapRun::StatusSeq() const {
  if (!working_) return 0;
  int64_t seq = item_open_ ? cursor_seq_ - 1 : cursor_seq_;
  if (!uncommitted_.empty()) seq = std::min(seq, *uncommitted_.begin() - 1);
  return std::max<int64_t>(0, seq);
}

void SubmapRun::PublishStatus() {
  submap_t status = ToMessage(*statistics_);
  status.submap_id = submap_id_;
  status.epoch = epoch_;
  status.owner = node_.instance();
  status.num_images = num_images();
  if (merging_) {
    const bool is_source = merging_->source_id == submap_id_;
    status.state = is_source ? submap_t::FROZEN : submap_t::ACTIVE;
    status.reason = is_source ? "merges into submap " + std::to_string(merging_->target_id)
                              : "absorbs submap " + std::to_string(merging_->source_id);
  }
  status.ledger_seq = StatusSeq();
  status.memory_bytes = ResidentMemoryBytes();
  node_.Publish(kSubmapStatusChannel, status);
}

void SubmapRun::Tick() {
  if (ended_ || !begun_) return;
  Pump();
  if (!ended_) PublishStatus();
  Maintain();
}

// In small parts, so that a photo that comes does not wait.
void SubmapRun::Maintain() {
  if (ended_ || !working_ || busy_ || !maintaining_ || final_due_s_ < HUGE_VAL) return;
  const bool at_rest = MonotonicS() - last_event_s_ >= kRestS;
  RunJob(
      [at_rest](Submap& submap, Outcome* outcome) {
        outcome->maintaining = submap.Maintain(
            at_rest, [outcome](const PhotoEvent& event) { outcome->events.push_back(event); });
        outcome->more = !outcome->events.empty();  // what was withdrawn may be tried anew
      },
      [this](const Outcome& outcome) {
        maintaining_ = outcome.maintaining;
        OnOutcome(outcome);
        std::weak_ptr<bool> alive = alive_;
        node_.loop().AddOneShot(kMaintenancePeriodS, [this, alive] {
          if (!alive.expired()) Maintain();
        });
      });
}

void SubmapRun::Answer(const shared_request_t& request) {
  if (ended_ || !working_) return;
  auto shared = std::make_shared<Bytes>();
  RunOnSubmap([ids = request.image_ids,
               shared](Submap& submap) { *shared = EncodeSharedImages(submap.ExportShared(ids)); },
              [this, shared, request] {
                shared_reply_t reply{};
                reply.request_id = request.request_id;
                reply.submap_id = submap_id_;
                reply.epoch = epoch_;
                reply.owner = node_.instance();
                reply.blob_id = node_.blobs().Serve(std::move(*shared));
                reply.ledger_seq = StatusSeq();
                node_.Publish(kSharedReplyChannel, reply);
              });
}

// Tells everyone that the submap is no more.
void SubmapRun::Dissolve(const std::string& reason) {
  busy_ = true;
  submap_t fact = ToMessage(SubmapStatistics());
  fact.submap_id = submap_id_;
  fact.epoch = epoch_;
  fact.owner = node_.instance();
  fact.state = submap_t::ENDED;
  fact.reason = ClampText(reason);
  fact.ledger_seq = 0;
  fact.header.fact_id =
      "submap/" + std::to_string(submap_id_) + "/" + std::to_string(epoch_) + "/dissolved";
  Submit(
      fact, [this, reason](int64_t) { End(EndKind::kOver, reason); },
      [this, reason](const std::string&) { End(EndKind::kFailed, reason); });
}

void SubmapRun::End(EndKind kind, const std::string& reason) {
  if (ended_) return;
  ended_ = true;
  on_end_(kind, reason);
}

}  // namespace skein
