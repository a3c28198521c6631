#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "event_loop/alive.h"
#include "event_loop/worker_thread.h"
#include "mapper/comparison_answers.h"
#include "mapper/finish_steps.h"
#include "mapper/item_log.h"
#include "mapper/lease.h"
#include "mapper/merge_executor.h"
#include "mapper/model_assessment.h"
#include "mapper/model_loader.h"
#include "mapper/model_writer.h"
#include "mapper/offered_photos.h"
#include "mapper/photo_loader.h"
#include "mapper/photo_reports.h"
#include "mapper/run_state.h"
#include "mapper/shape_teller.h"
#include "mapper/submap_worker.h"
#include "mapper/submissions.h"
#include "mapping/submap.h"
#include "node/ledger_follower.h"
#include "node/node.h"
#include "session/session_state.h"

namespace skein {

struct SubmapRunOptions {
  SubmapOptions submap;
  bool one_home = true;  // see OfferedPhotos
  CheckpointPace checkpoint;
  double target_gsd_mm = 0;  // of the final model's completeness, see AssessModel

  Status Check() const;
};

// The threads a run works with; they outlive it. All runs of a process share them.
struct MapperThreads {
  WorkerThread& worker;           // owns the submaps: every access to one is a job here
  WorkerThread& writer;           // hashes and writes checkpoints
  std::atomic<int64_t>& current;  // submap whose job was the last to begin on `worker`
  ShapeDesk& shapes;              // makes what the live view shows
};

// Parts of the ledger that a run reads; all outlive the run.
struct LedgerView {
  const SessionState& session;
  const ItemLog& items;
  const LedgerFollower& follower;
};

// One leased submap, from its seed or its last checkpoint on (run_state.h). Works through the
// ledger's items in order, one after the other; an item is done when the photos it unlocked are
// tried, too. A merge waits for no item. A photo takes one trip to the worker: decode, add, try.
// The state of a single submap is a function of seed, ledger and epoch. With several submaps the
// state is no such function: homes and merges go by what each has read so far. Loop's thread only.
class SubmapRun {
 public:
  // Why a run ended. `failed_step`: of the work on the submap, which the next run tries again or
  // leaves out; "": the submap has ended or the lease is another's.
  struct Ending {
    std::string failed_step;
    std::string reason;
  };
  using OnEnd = std::function<void(const Ending&)>;

  // `on_end` is called once; the run must not be destroyed within the call.
  SubmapRun(Node& node, const LedgerView& ledger, MapperThreads threads,
            const SubmapRunOptions& options, const Lease& lease, OnEnd on_end);

  int64_t submap_id() const { return lease_.submap_id; }
  int64_t epoch() const { return lease_.epoch; }
  int num_images() const { return reports_.num_registered(); }
  bool IsRegistered(int64_t image_id) const { return reports_.IsRegistered(image_id); }
  int backlog() const { return cursor_.num_left() + offered_.num_ours(); }

  // The ledger has another fact.
  void OnFact(const Fact& fact);
  // Once a second: tells the submap's state; writes a checkpoint when one is due.
  void Tick();
  void Answer(const shared_request_t& request);

  // For the run's parts: merges, a finish, answers.

  // Result of a job, for the loop.
  struct Outcome {
    std::vector<PhotoEvent> events;
    bool more = false;         // the submap's queue is not empty
    bool maintaining = false;  // the submap has to tidy up after a background BA
    Status status;
    std::optional<SubmapStatistics> statistics;
    double statistics_s = 0;                 // that they took
    double consolidate_s = 0, finish_s = 0;  // roughly, if they came next

    Submap::EventSink Sink() {
      return [this](const PhotoEvent& event) { events.push_back(event); };
    }
  };
  using Job = std::function<void(Submap&, Outcome*)>;
  using OnOutcome = std::function<void(const Outcome&)>;

  int64_t worked_seq() const { return cursor_.seq(); }
  // Everything up to here is done, and the ledger has taken what it was told of it.
  int64_t told_seq() const;
  // On the worker's thread, see SubmapWorker. The submap knows by then what others hold.
  template <class Job, class Then>
  void RunOnWorker(const std::string& step, Job job, Then then) {
    TellHeldElsewhere();
    worker_.Run(step, std::move(job), std::move(then));
  }
  // The same as the run's activity; then `then`.
  void RunJob(const std::string& step, Job job, OnOutcome then);
  // Reports a job's events and goes on.
  void Apply(const Outcome& outcome);
  // Does what there is to do until something is under way, or nothing is left.
  void Pump();
  void PublishStatus();
  // The final model is written next.
  void AskForFinal();
  void LoadPhotos(const std::vector<int64_t>& image_ids, PhotoLoader::OnLoaded on_loaded);
  void LoadModel(const std::string& step, const std::string& blob_id,
                 ModelLoader::OnLoaded on_loaded);
  // Whether a step failed three times, and its last reason.
  bool IsLeftOut(const std::string& step) const;
  std::string WhyLeftOut(const std::string& step) const;
  // Tells everyone that the submap is no more.
  void Dissolve(const std::string& reason);
  // `committed` when the ledger has it, `refused` when ingest cannot take it. When the lease is
  // another's or the submap has ended, the run ends instead.
  void Submit(Fact fact, Submissions::OnCommitted committed, Submissions::OnRefused refused);
  // Calls `then` once everything submitted so far is decided.
  void WhenDecided(std::function<void()> then) { submissions_.WhenDecided(std::move(then)); }
  // Tells what became of photos and notes it.
  void Report(const std::vector<PhotoEvent>& events);
  // Photos that came with another submap are registered here now; a checkpoint follows.
  void OnAbsorbed(const std::vector<PhotoEvent>& events);
  // The merge that was begun has ended, and the submap lives on.
  void OnMergeOver();

 private:
  bool IsFree() const { return state_.Is(Life::kRunning) && state_.IsIdle(); }
  bool DoNext();
  bool GoOn();
  void TellProgressSoon();
  bool IsTurnOfMerge(std::optional<int64_t> merge_id) const;
  bool WriteDueModel();
  void Begin();
  void Seed(const seed_t& seed);
  void Restore(const submap_model_t& model);
  void OnModel(const LoadedModel& loaded, const submap_model_t& model);
  void OnRestored(const Outcome& outcome, const submap_model_t& model);
  void StartRunning(int64_t seq, int64_t merge_seq);

  void TryNext();
  bool HasLargerNeighbour() const;
  void DoItem(const Item& item);
  void DoMatches(int64_t image_id);
  void DoMerge(int64_t merge_id);
  void Maintain();
  void MaintainSoon();
  void WriteModel(ModelWriter::Kind kind);
  void Encode(ModelWriter::Kind kind, std::optional<ModelAssessment> assessment);

  void TellHeldElsewhere();
  void OnJob(const Outcome& outcome, const OnOutcome& then);
  void OfferNeighboursOf(const std::vector<PhotoEvent>& events);
  void OfferNeighboursOf(int64_t image_id);

  std::string Detail() const;
  void LeaveOutSteps();
  void LeaveOutPhotos();
  void Fail(const std::string& step, const std::string& reason);
  void End(const Ending& ending);

  Node& node_;
  const LedgerView ledger_;
  const Lease lease_;
  const OnEnd on_end_;
  const int max_images_all_global_;

  const std::shared_ptr<std::atomic<bool>> is_cut_;  // IsCut for the worker's thread
  RunState state_;
  SubmapWorker worker_;
  ItemCursor cursor_;
  Submissions submissions_;
  PhotoReports reports_;
  OfferedPhotos offered_;
  PhotoLoader photos_;
  ModelLoader models_;
  ModelWriter writer_;
  ShapeTeller shape_;
  MergeExecutor merges_;
  FinishSteps finish_;
  ComparisonAnswers answers_;

  bool more_ = false;         // the submap's queue is not empty
  bool maintaining_ = false;  // see Submap::Maintain
  bool maintenance_is_due_ = false;
  bool status_due_ = false;  // an item was done since the last status
  bool progress_is_due_ = false;
  int64_t status_seq_ = 0;  // of the last status
  double last_event_s_ = 0;
  SubmapStatistics statistics_;  // of the last job that computed them
  double statistics_due_s_ = 0;
  Alive alive_;
};

}  // namespace skein
