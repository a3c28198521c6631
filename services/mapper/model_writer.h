#pragma once

#include <cmath>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>

#include "blobs/blob_client.h"
#include "core/clock.h"
#include "core/result.h"
#include "event_loop/alive.h"
#include "event_loop/worker_thread.h"
#include "mapper/item_log.h"
#include "mapper/lease.h"
#include "mapper/model_assessment.h"
#include "mapper/submap_worker.h"
#include "mapper/submissions.h"
#include "skein/submap_model_t.hpp"

namespace skein {

// Pace of checkpoints: what a crash costs against the bytes that are written. Only tests have
// another.
struct CheckpointPace {
  int photos = 10;  // new ones, at least; a tenth of the submap if that is more
  double period_s = 20;
};

// Writes a submap's models: checkpoints and, at the end of a finish, the final one. A checkpoint is
// encoded by a process of its own, so that registration goes on; a final model is waited for. The
// writer's thread hashes and stores either. Loop's thread only.
class ModelWriter {
 public:
  enum class Kind { kCheckpoint, kFinal };
  // Submits a model's fact.
  using SubmitModel = std::function<void(submap_model_t, Submissions::OnRefused)>;

  ModelWriter(BlobClient& blobs, SubmapWorker& worker, WorkerThread& writer, const Lease& lease,
              const CheckpointPace& pace, Clock clock, SubmitModel submit);

  // The run begins where the ledger is at `seq`. Its models are numbered from there: an earlier
  // process may have written some in the same epoch.
  void NumberFrom(int64_t seq) { last_number_ = seq; }
  // So many photos came or went.
  void NoteChanges(int num) { num_changes_ += num; }
  void AskForFinal() { final_due_s_ = 0; }
  bool AwaitsFinal() const { return final_due_s_ < HUGE_VAL; }
  // The next checkpoint waits for nothing but a change.
  void HurryCheckpoint() { last_checkpoint_s_ = 0; }
  bool IsHurried() const { return last_checkpoint_s_ == 0; }

  // The kind of model that is to be written now; nullopt if none. all_decided: the ledger has taken
  // all that it has been told, which a final model must hold.
  std::optional<Kind> Due(int num_images, bool all_decided) const;

  // Writes the submap as it is when all items up to there are done. `encoded` is called once
  // the worker is free again, for a final model with the statistics of its very state.
  // `assessment`: nullopt, the model tells nothing of its place.
  using OnEncoded = std::function<void(const std::optional<SubmapStatistics>&)>;
  void Write(Kind kind, const ItemCursor& done, int num_images, const SubmapStatistics& statistics,
             std::optional<ModelAssessment> assessment, OnEncoded encoded);

 private:
  // Being encoded or stored.
  struct Model {
    Kind kind = Kind::kCheckpoint;
    int64_t ledger_seq = 0, merge_seq = 0;
    int num_images = 0;
    SubmapStatistics statistics;
    std::optional<ModelAssessment> assessment;
  };
  // Gives the bytes; waits, in any thread.
  using Reader = std::function<Result<Bytes>()>;

  static Reader StartEncoding(Submap* submap, bool in_child);
  void Store(const Reader& read);
  void OnStored(const std::string& blob);
  submap_model_t MakeFact(const Model& model, const std::string& blob);
  void TryAgain(Kind kind);

  BlobClient& blobs_;
  SubmapWorker& worker_;
  WorkerThread& writer_;
  const Lease lease_;
  const CheckpointPace pace_;
  const Clock clock_;
  const SubmitModel submit_;
  std::optional<Model> under_way_;  // one at a time
  int num_changes_ = 0;             // photos since the last checkpoint
  int64_t last_number_ = 0;         // of a model
  double last_checkpoint_s_;
  double final_due_s_ = HUGE_VAL;
  Alive alive_;
};

}  // namespace skein
