#pragma once

#include <cmath>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "event_loop/worker_thread.h"
#include "mapper/ledger_index.h"
#include "mapper/merge_handler.h"
#include "mapper/photo_loader.h"
#include "mapping/submap.h"
#include "node/ledger_follower.h"
#include "node/node.h"

namespace skein {

struct SubmapRunOptions {
  SubmapOptions submap;
  int checkpoint_photos = 10;  // new photos, at least; a tenth of the submap if that is more
  double checkpoint_period_s = 20;
};

// The threads a run works with; they outlive it.
struct MapperThreads {
  WorkerThread& worker;  // owns the submap: every access to it is a job here
  WorkerThread& writer;  // hashes and writes checkpoints
};

// One leased submap, from its seed or its last checkpoint on. Works through the ledger's items in
// order, one after the other; an item is done when the photos it unlocked are tried, too. Its state
// is a function of seed, ledger and epoch. Loop's thread only; heavy work is done by the worker.
class SubmapRun {
 public:
  // kOver: the submap has ended or the lease is another's. kFailed: it could not be taken over.
  enum class EndKind { kOver, kFailed };
  using OnEnd = std::function<void(EndKind, const std::string& reason)>;

  // `on_end` is called once; the run must not be destroyed within the call.
  SubmapRun(Node& node, const LedgerIndex& index, const LedgerFollower& follower,
            MapperThreads threads, const SubmapRunOptions& options, MergeHandler* merges,
            int64_t submap_id, int64_t epoch, OnEnd on_end);
  ~SubmapRun();

  int64_t submap_id() const { return submap_id_; }
  int64_t epoch() const { return epoch_; }

  // The index has taken another fact.
  void OnFact(const Fact& fact);
  // Once a second: tells the submap's state; writes a checkpoint when one is due.
  void Tick();
  void Answer(const shared_request_t& request);

  // For merges. Runs `job` on the submap and then `then` on the loop, unless the run is gone.
  void RunOnSubmap(std::function<void(Submap&)> job, std::function<void()> then);
  // Loads photos that are not yet in the submap and adds them.
  void AddPhotos(const std::vector<int64_t>& image_ids, std::function<void(Status)> then);
  // Submits for the submap; `then` when it is committed, `refused` when ingest cannot take it. When
  // the lease is another's or the submap has ended, the run ends instead.
  using OnRefused = std::function<void(const std::string& reason)>;
  void Submit(Fact fact, std::function<void(int64_t seq)> then, OnRefused refused);
  // Photos that came with another submap are registered here now; a checkpoint follows.
  void TakeOver(const std::vector<PhotoEvent>& events);
  // Calls `then` once everything submitted so far is decided.
  void WhenCommitted(std::function<void()> then);
  // Expires with the run.
  std::weak_ptr<bool> alive() const { return alive_; }
  // Tells what became of photos and notes it.
  void Report(const std::vector<PhotoEvent>& events);

  int num_images() const { return static_cast<int>(registered_.size()); }
  int backlog() const;

 private:
  using Item = LedgerIndex::Item;
  // What a job found out, for the loop.
  struct Outcome {
    std::vector<PhotoEvent> events;
    bool more = false;         // the submap's queue is not empty
    bool maintaining = false;  // the submap has to tidy up after a background BA
    std::string error;
  };

  void Pump();
  void Begin();
  void BeginFromSeed(const seed_t& seed);
  void BeginFromModel(const submap_t& model);
  void Restore(std::shared_ptr<const ModelArchive> archive, int64_t ledger_seq);
  void OnRestored(const Outcome& outcome, int64_t ledger_seq);
  void StartWorking(int64_t seq);

  void LoadWanted();
  void DoItem(const Item& item);
  void DoMatches(int64_t image_id);
  void Consolidate();
  void DoSettled(const Item& item);
  void DoMerge(const Item& item);
  void RunJob(std::function<void(Submap&, Outcome*)> job, std::function<void(const Outcome&)> then);
  void OnOutcome(const Outcome& outcome);
  void WantNeighboursOf(int64_t image_id);
  void NoteLostPhotos();
  void OnReportRefused(const PhotoEvent& event, const std::string& reason);
  void TakeBackRefused();

  void Maintain();
  bool CheckpointIsDue() const;
  bool FinalIsDue() const;
  void WriteModel(int8_t state, int64_t ledger_seq, std::function<void()> then);
  void StoreModel(const std::function<Result<Bytes>()>& read, int8_t state, int64_t ledger_seq);
  void SubmitModel(int8_t state, int64_t ledger_seq, const std::string& blob);
  void TryModelAgain(int8_t state);
  int64_t StatusSeq() const;
  void PublishStatus();
  void Dissolve(const std::string& reason);
  void End(EndKind kind, const std::string& reason);

  Node& node_;
  const LedgerIndex& index_;
  const LedgerFollower& follower_;
  const MapperThreads threads_;
  const SubmapRunOptions options_;
  MergeHandler* const merges_;
  const int64_t submap_id_;
  const int64_t epoch_;
  const OnEnd on_end_;

  std::shared_ptr<Submap> submap_;                // touched by the worker's jobs only
  std::shared_ptr<SubmapStatistics> statistics_;  // of the last job that computed it
  PhotoLoader loader_;
  bool begun_ = false;
  bool working_ = false;      // seeded or restored
  bool busy_ = false;         // a job or a load is under way
  bool more_ = false;         // the submap's queue is not empty
  bool is_drained_ = false;   // a finish has all photos' matches, and is not settled
  bool maintaining_ = false;  // see Submap::Maintain
  bool ended_ = false;
  std::optional<merge_t> merging_;  // the order being carried out
  size_t cursor_ = 0;               // next item
  int64_t cursor_seq_ = 0;          // everything up to here is known to the submap
  bool item_open_ = false;          // the item at cursor_seq_ is not done
  int64_t lost_check_seq_ = 0;      // where replay has reached what the former mapper knew
  std::set<int64_t> present_;       // photos that the submap has
  std::set<int64_t> wanted_;        // photos to load
  std::set<int64_t> registered_;
  std::map<int64_t, int> num_facts_;    // of a photo
  std::multiset<int64_t> uncommitted_;  // seqs at which facts under way were computed
  std::vector<std::function<void()>> when_committed_;
  double last_event_s_ = 0;
  double statistics_due_s_ = 0;
  bool status_due_ = false;  // an item was done since the last status

  std::map<int64_t, std::string> refused_;  // registrations that ingest refused, with the reason
  double final_due_s_ = HUGE_VAL;           // when the final model is to be written
  int num_changes_ = 0;                     // photos since the last checkpoint
  int num_checkpoints_ = 0;
  double checkpoint_s_ = 0;
  bool writing_ = false;
  std::shared_ptr<bool> alive_ = std::make_shared<bool>(true);
};

}  // namespace skein
