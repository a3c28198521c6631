#include "mapper/submap_run.h"

#include <algorithm>
#include <map>
#include <utility>

#include "core/clock.h"
#include "core/log.h"
#include "core/option_check.h"
#include "core/process.h"
#include "mapper/messages.h"
#include "mapping/checkpoint.h"
#include "session/one_spot.h"
#include "session/photo_homes.h"
#include "session/submap_facts.h"
#include "session/submap_steps.h"

namespace skein {
namespace {

constexpr double kStatisticsPeriodS = 1.0;
constexpr double kMaintenancePeriodS = 0.1;
constexpr double kProgressDelayS = 0.05;

// Being asked whether to stop is a sign that the job goes on.
SubmapOptions OptionsOfRun(SubmapOptions options, std::shared_ptr<const std::atomic<bool>> stopped,
                           WorkerThread& worker, StepRecord& steps, const Lease& lease) {
  options.stop = [stopped = std::move(stopped), &worker] {
    worker.NoteProgress();
    return stopped->load();
  };
  options.enter = [&steps, id = lease.submap_id](SubmapOptions::Part part, int64_t image_id) {
    const bool is_photo = part == SubmapOptions::Part::kPhoto;
    return std::make_shared<StepRecord::Scope>(
        &steps, kWorkerSlot, Step{id, is_photo ? PhotoStep(image_id) : MaintenanceStep()});
  };
  return options;
}

Status StartFromSeed(const seed_t& seed, Submap* submap, const Submap::EventSink& sink) {
  return submap
      ->Start(OptionsOfSeed(seed.num_inliers, seed.tri_angle_rad), seed.image_id1, seed.image_id2,
              sink)
      .status;
}

// An error, with its reason, if no map would be left without one of them.
Status TakeBack(const std::map<int64_t, std::string>& refused, Submap* submap,
                const Submap::EventSink& sink) {
  Status last;
  for (const auto& [id, reason] : refused) {
    if (!submap->TakeBack(id, {Refusal::Cause::kOther, reason}, sink))
      last = FailedPrecondition(reason);
  }
  return last;
}

PhotoEvent Unreadable(int64_t image_id, const Status& status) {
  PhotoEvent event;
  event.image_id = image_id;
  event.state = PhotoEvent::State::kRejected;
  event.refusal.text =
      "its keypoints or matches cannot be read" + (status.ok() ? "" : ": " + status.error());
  return event;
}

bool HasRegistered(const std::vector<PhotoEvent>& events) {
  return std::any_of(events.begin(), events.end(), [](const PhotoEvent& event) {
    return event.state == PhotoEvent::State::kRegistered;
  });
}

}  // namespace

Status SubmapRunOptions::Check() const {
  return FirstError({submap.Check(), InRange("target_gsd", target_gsd_mm, 0.0, 1e6)});
}

SubmapRun::SubmapRun(Node& node, const LedgerView& ledger, MapperThreads threads,
                     const SubmapRunOptions& options, const Lease& lease, OnEnd on_end)
    : node_(node),
      ledger_(ledger),
      lease_(lease),
      on_end_(std::move(on_end)),
      max_images_all_global_(options.submap.max_images_all_global),
      is_cut_(std::make_shared<std::atomic<bool>>(ledger.session.finish().is_cut())),
      worker_(threads.worker, threads.current, node.steps(), lease.submap_id,
              OptionsOfRun(options.submap, is_cut_, threads.worker, node.steps(), lease),
              [this](const std::string& step, const std::string& reason) { Fail(step, reason); }),
      cursor_(ledger.items),
      submissions_(
          node.submitter(),
          [this](const std::string& reason) {
            End({"", reason});
          },
          [this] {
            PublishStatus();
            Pump();
          }),
      reports_(
          ledger.session, lease,
          [this](Fact fact, auto committed, auto refused) {
            Submit(std::move(fact), std::move(committed), std::move(refused));
          },
          [this] { Pump(); }),
      offered_(ledger.session, lease.submap_id, options.one_home),
      photos_(node.blobs(), ledger.session),
      models_(node.blobs(), worker_, photos_),
      writer_(
          node.blobs(), worker_, threads.writer, lease, options.checkpoint,
          [&loop = node.loop()] { return loop.now_s(); },
          [this](submap_model_t fact, auto refused) {
            Submit(
                std::move(fact), [](int64_t) {}, std::move(refused));
          }),
      shape_(node, worker_, threads.shapes, lease),
      merges_(node, ledger.session, *this),
      finish_(ledger.session, options.target_gsd_mm, *this),
      answers_(node, ledger.session, photos_, *this) {
  Pump();
}

void SubmapRun::OnFact(const Fact& fact) {
  if (state_.Is(Life::kEnded)) return;
  *is_cut_ = finish_.IsCut();
  if (const SubmapLife* submap = ledger_.session.FindSubmap(submap_id())) {
    if (submap->lease.epoch > epoch()) {
      return End({"", "the lease went to " + submap->lease.owner});
    }
    if (submap->ended) return End({"", "the map has ended"});
  }
  offered_.OnFact(fact);
  const auto* merge = std::get_if<merge_t>(&fact);
  if (merge != nullptr && merge->state != merge_t::ORDERED) merges_.OnMergeFact(*merge);
  if (std::holds_alternative<submap_end_t>(fact)) merges_.OnSubmapEnd();
  if (finish_.IsCut()) merges_.GiveUp();
  Pump();
}

// Does what there is to do until something is under way, or nothing is left.
void SubmapRun::Pump() {
  if (state_.Is(Life::kAwaitingLease)) return Begin();
  while (IsFree() && DoNext()) continue;
}

// False if there was nothing to do.
bool SubmapRun::DoNext() {
  if (!reports_.HasRefused()) {
    if (writer_.IsHurried() && WriteDueModel()) return true;
    if (IsTurnOfMerge(cursor_.PeekMerge())) {
      DoMerge(*cursor_.NextMerge());
      return true;
    }
    if (finish_.IsCut() || (!more_ && (!offered_.HasOurs() || finish_.IsFinal()))) return GoOn();
  }
  TryNext();
  return true;
}

// A merge that ended DONE is carried out again where it was: what the target had worked through by
// then is what the source was compared with.
bool SubmapRun::IsTurnOfMerge(std::optional<int64_t> merge_id) const {
  if (!merge_id) return false;
  const merge_t& latest = ledger_.session.FindMerge(*merge_id)->latest();
  return latest.state != merge_t::DONE || cursor_.HasReached(latest.ledger_seq);
}

// A checkpoint must not supersede the final model before the finish is over: it tells less.
bool SubmapRun::WriteDueModel() {
  const auto kind = writer_.Due(num_images(), submissions_.empty());
  if (!kind || (*kind == ModelWriter::Kind::kCheckpoint && finish_.IsFinal())) return false;
  WriteModel(*kind);
  return true;
}

// The item that was open is done.
bool SubmapRun::GoOn() {
  cursor_.Close();
  Report(reports_.FindLost(cursor_));
  if (WriteDueModel()) return true;
  if (const std::optional<Item> item = cursor_.Next()) {
    status_due_ = true;
    DoItem(*item);
    return true;
  }
  cursor_.SkipTo(ledger_.follower.processed_seq());
  if (std::exchange(status_due_, false)) PublishStatus();
  if (ledger_.session.finishing()) TellProgressSoon();
  return false;
}

// The merger goes on when each submap has worked up to the newest fact, whoever that is of.
void SubmapRun::TellProgressSoon() {
  if (told_seq() <= status_seq_ || std::exchange(progress_is_due_, true)) return;
  node_.loop().AddOneShot(kProgressDelayS, alive_.Guarded([this] {
    progress_is_due_ = false;
    if (state_.Is(Life::kRunning) && told_seq() > status_seq_) PublishStatus();
  }));
}

void SubmapRun::Begin() {
  // The lease's fact comes after all that earlier epochs have committed. What a process of this
  // name has committed in this epoch comes after it: so the ledger is read up to its end.
  const SubmapLife* submap = ledger_.session.FindSubmap(submap_id());
  if (submap == nullptr || submap->lease.epoch < epoch() || !ledger_.follower.caught_up()) return;
  if (!submap->has_seed && !submap->latest_model) return;
  const int64_t head = ledger_.follower.processed_seq();
  reports_.ExpectReplayUpTo(head);
  reports_.NumberFrom(head);
  writer_.NumberFrom(head);
  LeaveOutSteps();
  submap->latest_model ? Restore(*submap->latest_model) : Seed(submap->seed);
}

void SubmapRun::Seed(const seed_t& seed) {
  state_.Become(Life::kSeeding);
  LoadPhotos({seed.image_id1, seed.image_id2}, [this, seed](const FetchedPhotos& photos) {
    RunJob(
        SeedStep(),
        [photos, seed](Submap& submap, Outcome* outcome) {
          outcome->status = AddToSubmap(photos, &submap);
          if (!outcome->status.ok()) return;
          outcome->status = StartFromSeed(seed, &submap, outcome->Sink());
          outcome->more = true;
        },
        [this, seq = seed.header.seq](const Outcome& outcome) {
          if (!outcome.status.ok()) return Dissolve("initial pair: " + outcome.status.error());
          StartRunning(seq, seq);
          Apply(outcome);
        });
  });
}

void SubmapRun::Restore(const submap_model_t& model) {
  state_.Become(Life::kRestoring);
  state_.Become(Activity::kLoading);
  LogInfo("submap {} goes on from seq {}", submap_id(), model.ledger_seq);
  LoadModel(RestoreStep(), model.model_blob, [this, model](const Result<LoadedModel>& loaded) {
    if (!loaded.ok()) return Fail(RestoreStep(), "checkpoint: " + loaded.error());
    OnModel(*loaded, model);
  });
}

void SubmapRun::OnModel(const LoadedModel& loaded, const submap_model_t& model) {
  RunJob(
      RestoreStep(),
      [loaded](Submap& submap, Outcome* outcome) {
        outcome->status = AddToSubmap(loaded.photos, &submap);
        if (!outcome->status.ok()) return;
        outcome->status = RestoreSubmap(*loaded.archive, &submap);
        outcome->events = submap.RegisteredEvents();
      },
      [this, model](const Outcome& outcome) { OnRestored(outcome, model); });
}

void SubmapRun::OnRestored(const Outcome& outcome, const submap_model_t& model) {
  if (!outcome.status.ok()) return Fail(RestoreStep(), "checkpoint: " + outcome.status.error());
  StartRunning(model.ledger_seq, model.merge_seq);
  Report(reports_.NoteRestored(outcome.events));
  OfferNeighboursOf(outcome.events);
  Pump();
}

void SubmapRun::StartRunning(int64_t seq, int64_t merge_seq) {
  state_.Become(Life::kRunning);
  cursor_.StartAfter(seq, merge_seq);
  offered_.Start();
}

bool SubmapRun::IsLeftOut(const std::string& step) const {
  return ledger_.session.FindSubmap(submap_id())->IsLeftOut(step);
}

std::string SubmapRun::WhyLeftOut(const std::string& step) const {
  return ledger_.session.FindSubmap(submap_id())->failed_steps.at(step).reason;
}

// What failed three times in earlier runs.
void SubmapRun::LeaveOutSteps() {
  LeaveOutPhotos();
  if (IsLeftOut(ShapeStep())) shape_.LeaveOut();
  if (!IsLeftOut(MaintenanceStep())) return;
  RunOnWorker(
      TrialsStep(),
      [](Submap& submap) {
        submap.LeaveOutMaintenance();
        return true;
      },
      [](bool) {});
}

// Photos whose trial failed three times. Nobody waits for them here.
void SubmapRun::LeaveOutPhotos() {
  std::vector<int64_t> ids;
  std::vector<PhotoEvent> events;
  const SubmapLife& submap = *ledger_.session.FindSubmap(submap_id());
  for (const auto& [id, photo] : ledger_.session.photos()) {
    if (!submap.IsLeftOut(PhotoStep(id))) continue;
    ids.push_back(id);
    const auto told = submap.photos.find(id);
    if (told != submap.photos.end() && told->second.state == registration_t::REJECTED) continue;
    PhotoEvent event;
    event.image_id = id;
    event.state = PhotoEvent::State::kRejected;
    event.refusal.text = "the mapper failed at it three times: " + WhyLeftOut(PhotoStep(id));
    events.push_back(event);
  }
  if (ids.empty()) return;
  RunOnWorker(
      TrialsStep(),
      [ids](Submap& submap) {
        for (const int64_t id : ids) submap.LeaveOut(id);
        return true;
      },
      [](bool) {});
  Report(events);
}

void SubmapRun::LoadPhotos(const std::vector<int64_t>& image_ids, PhotoLoader::OnLoaded on_loaded) {
  state_.Become(Activity::kLoading);
  photos_.Load(image_ids, [this, on_loaded = std::move(on_loaded)](FetchedPhotos photos) {
    if (!state_.Is(Life::kEnded)) on_loaded(std::move(photos));
  });
}

void SubmapRun::LoadModel(const std::string& step, const std::string& blob_id,
                          ModelLoader::OnLoaded on_loaded) {
  models_.Load(step, blob_id, [this, on_loaded = std::move(on_loaded)](Result<LoadedModel> model) {
    if (!state_.Is(Life::kEnded)) on_loaded(std::move(model));
  });
}

// One trip to the worker. Loaded photos are added and queued. Photos that the ledger refused leave
// the map. Then the queued photo that sees most points is tried.
void SubmapRun::TryNext() {
  const std::vector<int64_t> ids = offered_.TakeOurs();
  LoadPhotos(ids, [this, ids](const FetchedPhotos& photos) {
    RunJob(
        TrialsStep(),
        [photos, ids, refused = reports_.TakeRefused(), has_larger = HasLargerNeighbour()](
            Submap& submap, Outcome* outcome) {
          submap.SetHasLargerNeighbour(has_larger);
          const Status added = AddToSubmap(photos, &submap);
          for (const int64_t id : ids) {
            submap.Enqueue(id);
            if (!submap.map().HasPhoto(static_cast<ImageId>(id))) {
              outcome->events.push_back(Unreadable(id, added));
            }
          }
          outcome->status = TakeBack(refused, &submap, outcome->Sink());
          if (outcome->status.ok()) outcome->more = submap.Step(outcome->Sink());
        },
        [this](const Outcome& outcome) {
          if (!outcome.status.ok()) return Dissolve("initial pair: " + outcome.status.error());
          Apply(outcome);
        });
  });
}

// Matters to a map that may still be mapped anew while it grows.
bool SubmapRun::HasLargerNeighbour() const {
  return num_images() <= max_images_all_global_ &&
         LargerNeighbour(ledger_.session, submap_id()) != 0;
}

void SubmapRun::DoItem(const Item& item) {
  // A photo that came later tells so of a map that one weak pair began.
  if (IsOfOneSpot(ledger_.session, submap_id())) return Dissolve("its photos are of one spot");
  item.kind == Item::Kind::kMatches ? DoMatches(item.id) : finish_.Do(item);
}

// A photo is the submap's business when it has a verified pair with a registered one.
void SubmapRun::DoMatches(int64_t image_id) {
  // It came with a merge before its matches' turn: those tell of others.
  if (reports_.IsRegistered(image_id)) return OfferNeighboursOf(image_id);
  for (const auto& pair : ledger_.session.covisibility().EdgesOf(image_id)) {
    if (pair.seq > cursor_.seq() || !reports_.IsRegistered(pair.other_id)) continue;
    offered_.Offer(image_id);
    return;
  }
}

void SubmapRun::DoMerge(int64_t merge_id) {
  const MergeState& merge = *ledger_.session.FindMerge(merge_id);
  const merge_t& ordered = merge.ordered();
  const bool ours = ordered.source_id == submap_id() || ordered.target_id == submap_id();
  if (!ours || merge.abandoned || merge.latest().state == merge_t::UNDONE) return;
  state_.Become(Activity::kMerging);
  merges_.OnOrdered(ordered);
  PublishStatus();
}

void SubmapRun::OnMergeOver() {
  if (!state_.Is(Life::kRunning)) return;
  state_.Become(Activity::kNone);
  more_ = true;
  Pump();
}

// In small parts, so that a photo that comes does not wait.
void SubmapRun::Maintain() {
  if (!IsFree() || !maintaining_ || writer_.AwaitsFinal() || finish_.IsCut()) return;
  if (IsLeftOut(MaintenanceStep())) return;
  const double idle_s = node_.loop().now_s() - last_event_s_;
  RunJob(
      MaintenanceStep(),
      [idle_s](Submap& submap, Outcome* outcome) {
        outcome->maintaining = submap.Maintain(idle_s, outcome->Sink());
        outcome->more = !outcome->events.empty();  // what was withdrawn may be tried again
      },
      [this](const Outcome& outcome) {
        maintaining_ = outcome.maintaining;
        Apply(outcome);
        MaintainSoon();
      });
}

void SubmapRun::MaintainSoon() {
  if (std::exchange(maintenance_is_due_, true)) return;
  node_.loop().AddOneShot(kMaintenancePeriodS, alive_.Guarded([this] {
    maintenance_is_due_ = false;
    Maintain();
  }));
}

void SubmapRun::WriteModel(ModelWriter::Kind kind) {
  state_.Become(Activity::kWriting);
  if (kind == ModelWriter::Kind::kCheckpoint) return Encode(kind, std::nullopt);
  finish_.Assess([this, kind](std::optional<ModelAssessment> assessment) {
    if (!state_.Is(Life::kEnded)) Encode(kind, std::move(assessment));
  });
}

void SubmapRun::Encode(ModelWriter::Kind kind, std::optional<ModelAssessment> assessment) {
  writer_.Write(kind, cursor_, num_images(), statistics_, std::move(assessment),
                [this](const std::optional<SubmapStatistics>& statistics) {
                  if (state_.Is(Life::kEnded)) return;
                  state_.Become(Activity::kNone);
                  statistics_ = statistics.value_or(statistics_);
                  Pump();
                });
}

// Before any job that may try photos or judge the map by those that it lacks.
void SubmapRun::TellHeldElsewhere() {
  const std::vector<std::pair<int64_t, bool>> changes = offered_.TakeHeldChanges();
  if (changes.empty()) return;
  worker_.Run(
      TrialsStep(),
      [changes](Submap& submap) {
        for (const auto& [id, held] : changes) submap.SetHeldElsewhere(id, held);
        return true;
      },
      [](bool) {});
}

void SubmapRun::RunJob(const std::string& step, Job job, OnOutcome then) {
  state_.Become(Activity::kJob);
  const bool count = node_.loop().now_s() >= statistics_due_s_;
  RunOnWorker(
      step,
      [job = std::move(job), count](Submap& submap) {
        Outcome outcome;
        job(submap, &outcome);
        const double start_s = MonotonicS();
        if (count) outcome.statistics = submap.Statistics();
        outcome.statistics_s = MonotonicS() - start_s;
        outcome.consolidate_s = submap.EstimateConsolidateS();
        outcome.finish_s = submap.EstimateFinishS();
        return outcome;
      },
      [this, then = std::move(then)](const Outcome& outcome) { OnJob(outcome, then); });
}

void SubmapRun::OnJob(const Outcome& outcome, const OnOutcome& then) {
  if (state_.Is(Life::kEnded)) return;
  state_.Become(Activity::kNone);
  shape_.NoteChange(HasRegistered(outcome.events));
  finish_.OnJobOver(outcome.consolidate_s, outcome.finish_s);
  if (outcome.statistics) {
    statistics_ = *outcome.statistics;
    // They visit all points: at most a hundredth of the time.
    statistics_due_s_ =
        node_.loop().now_s() + std::max(kStatisticsPeriodS, 100.0 * outcome.statistics_s);
  }
  then(outcome);
}

void SubmapRun::Apply(const Outcome& outcome) {
  more_ = outcome.more;
  if (!outcome.events.empty()) {
    maintaining_ = true;
    last_event_s_ = node_.loop().now_s();
  }
  Report(outcome.events);
  OfferNeighboursOf(outcome.events);
  if (!outcome.events.empty()) PublishStatus();
  Pump();
}

// Of those that are registered.
void SubmapRun::OfferNeighboursOf(const std::vector<PhotoEvent>& events) {
  for (const PhotoEvent& event : events) {
    if (reports_.IsRegistered(event.image_id)) OfferNeighboursOf(event.image_id);
  }
}

void SubmapRun::OfferNeighboursOf(int64_t image_id) {
  for (const auto& pair : ledger_.session.covisibility().EdgesOf(image_id)) {
    const bool known =
        pair.seq <= cursor_.seq() && ledger_.session.FindPhoto(pair.other_id)->through_matching();
    if (known && !reports_.IsRegistered(pair.other_id)) offered_.Offer(pair.other_id);
  }
}

void SubmapRun::Report(const std::vector<PhotoEvent>& events) {
  writer_.NoteChanges(static_cast<int>(events.size()));
  reports_.Tell(events);
}

void SubmapRun::OnAbsorbed(const std::vector<PhotoEvent>& events) {
  Report(events);
  OfferNeighboursOf(events);
  writer_.HurryCheckpoint();
  shape_.NoteChange(HasRegistered(events));
}

void SubmapRun::Submit(Fact fact, Submissions::OnCommitted committed,
                       Submissions::OnRefused refused) {
  submissions_.Submit(std::move(fact), cursor_.seq(), std::move(committed), std::move(refused));
}

int64_t SubmapRun::told_seq() const {
  int64_t seq = cursor_.done_seq();
  if (!submissions_.empty()) seq = std::min(seq, submissions_.FirstSeq() - 1);
  return std::max<int64_t>(0, seq);
}

void SubmapRun::PublishStatus() {
  submap_status_t status{};
  status.submap_id = submap_id();
  status.epoch = epoch();
  status.owner = node_.instance();
  status.state = submap_status_t::ACTIVE;
  SetFigures(statistics_, &status);
  status.num_images = num_images();
  const merge_t* merge = merges_.ordered();
  if (merge != nullptr && merge->source_id == submap_id()) status.state = submap_status_t::FROZEN;
  status.detail = Detail();
  status.ledger_seq = status_seq_ = told_seq();
  status.memory_bytes = ResidentMemoryBytes();
  node_.Publish(kSubmapStatusChannel, status);
}

// What a merge or a finish waits for here; "" if for nothing.
std::string SubmapRun::Detail() const {
  if (const merge_t* merge = merges_.ordered()) {
    return merge->source_id == submap_id() ? "merges into map " + std::to_string(merge->target_id)
                                           : "absorbs map " + std::to_string(merge->source_id);
  }
  if (!finish_.doing().empty() || !ledger_.session.finishing()) return finish_.doing();
  if (state_.Is(Activity::kWriting)) return "writes its model";
  return backlog() > 0 ? "photos to try: " + std::to_string(backlog()) : "";
}

void SubmapRun::Tick() {
  if (state_.Is(Life::kEnded)) return;
  Pump();
  if (state_.Is(Life::kAwaitingLease)) return;
  if (state_.Is(Life::kEnded)) return;
  PublishStatus();
  shape_.Tick();
  MaintainSoon();
}

void SubmapRun::Answer(const shared_request_t& request) {
  if (state_.Is(Life::kRunning)) answers_.Answer(request);
}

void SubmapRun::AskForFinal() {
  statistics_due_s_ = 0;
  writer_.AskForFinal();
  Pump();
}

void SubmapRun::Dissolve(const std::string& reason) {
  state_.Become(Life::kDissolving);
  Submit(
      MakeSubmapEnd(submap_id(), epoch(), reason),
      [this, reason](int64_t) {
        End({"", reason});
      },
      [this, reason](const std::string&) { Fail(SeedStep(), reason); });
}

void SubmapRun::Fail(const std::string& step, const std::string& reason) { End({step, reason}); }

void SubmapRun::End(const Ending& ending) {
  if (state_.Is(Life::kEnded)) return;
  state_.Become(Life::kEnded);
  on_end_(ending);
}

}  // namespace skein
