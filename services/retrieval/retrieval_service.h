#pragma once

// Follows the ledger: compares each photo with those before it, inserts it, and submits its
// candidates_t.

#include <deque>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>

#include "event_loop/failed_items.h"
#include "event_loop/worker_thread.h"
#include "node/ledger_follower.h"
#include "node/node.h"
#include "retrieval/retrieval_options.h"
#include "retrieval/retrieval_state.h"

namespace skein {

// Index and checkpoint live on a worker thread. With a shared session folder the checkpoint is
// retrieval/hnsw.bin, so a restart replays only the rest of the ledger. An unusable checkpoint is
// ignored with a warning, and the whole ledger is replayed. If a photo raises an exception, it gets
// an empty list of candidates: a process that stopped there would raise it again after each
// restart. A photo on which the process crashed or hung three times gets one likewise
// (event_loop/failed_items.h). Loop's thread only.
class RetrievalService {
 public:
  RetrievalService(Node& node, const RetrievalOptions& options);
  // Writes a last checkpoint.
  ~RetrievalService();

 private:
  using State = std::shared_ptr<RetrievalState>;

  // A change of the state, in ledger order. Runs on the worker's thread.
  struct Step {
    int64_t seq = 0;
    int64_t image_id = 0;
    bool asks = false;   // the step queries the index for the photo's candidates
    bool ready = false;  // its blob is here, if it needs one
    std::function<Result<std::optional<Candidates>>(RetrievalState*)> apply;
  };

  void Start(State state);
  State LoadCheckpoint() const;
  void OnFact(const Fact& fact);
  void OnFeatures(const features_t& features);
  void OnRegistration(const registration_t& registration);
  void OnFailure(const failure_t& failure);
  void OnBlob(int64_t seq, int64_t image_id, const Result<Bytes>& bytes);
  void RunReadySteps();
  // On the worker's thread.
  std::optional<Candidates> Apply(const Step& step, RetrievalState* state) const;
  void OnStepDone(int64_t seq, std::optional<Candidates> candidates);
  void Submit(const Candidates& candidates);
  void SubmitWhatIsOpen();
  void ForgetAnswer(int64_t image_id);
  void Checkpoint();
  void Tick();
  void FillHeartbeat(heartbeat_t* heartbeat) const;

  Node& node_;
  const RetrievalOptions options_;
  const std::filesystem::path checkpoint_path_;  // empty: no folder
  const FailedItems failed_;                     // photos; read by worker_, too

  State state_;                         // used by worker_ only, once started
  int64_t start_seq_ = 0;               // of the checkpoint
  int64_t done_seq_ = 0;                // of the last step done
  int64_t checkpoint_seq_ = 0;          // of the last checkpoint
  std::deque<Step> steps_;              // not yet handed to worker_
  std::map<int64_t, Candidates> open_;  // answers not known to be committed
  bool caught_up_ = false;              // the ledger was read to its end once
  int64_t num_done_ = 0;
  double sum_s_ = 0;
  double checkpoint_due_s_ = 0;

  std::unique_ptr<WorkerThread> worker_;
  std::unique_ptr<LedgerFollower> follower_;
  PollLoop::TimerId timer_ = 0;
};

}  // namespace skein
