// How a run writes its submap's models: checkpoints and, at the end of a finish, the final one.

#include <algorithm>
#include <utility>

#include "core/clock.h"
#include "core/log.h"
#include "core/process.h"
#include "core/snapshot.h"
#include "mapper/messages.h"
#include "mapper/submap_run.h"
#include "mapping/checkpoint.h"

namespace skein {
namespace {

// Of a copy of the submap, by a child process, where there can be one. The bytes come from what is
// returned; that waits, in any thread.
std::function<Result<Bytes>()> StartEncoding(Submap* submap, bool in_child) {
  const auto encode = [submap] { return EncodeModelArchive(SaveSubmap(submap)); };
  if (in_child) {
    const Result<std::shared_ptr<Snapshot>> snapshot = Snapshot::Take(encode);
    if (snapshot.ok()) return [taken = *snapshot] { return taken->Read(); };
    LogWarn("{}; the mapper waits for its checkpoint", snapshot.error());
  }
  auto archive = std::make_shared<const ModelArchive>(SaveSubmap(submap));
  return [archive]() -> Result<Bytes> { return EncodeModelArchive(*archive); };
}

}  // namespace

bool SubmapRun::CheckpointIsDue() const {
  if (writing_ || num_changes_ == 0 || final_due_s_ < HUGE_VAL) return false;
  const int photos = std::max(options_.checkpoint_photos, num_images() / 10);
  return num_changes_ >= photos || MonotonicS() - checkpoint_s_ >= options_.checkpoint_period_s;
}

// It holds what the ledger has been told and has taken.
bool SubmapRun::FinalIsDue() const {
  return !writing_ && uncommitted_.empty() && MonotonicS() >= final_due_s_;
}

// A checkpoint is encoded by a process of its own, so that registration goes on; a final model is
// waited for, with statistics of its very state. The writer hashes and stores either.
void SubmapRun::WriteModel(int8_t state, int64_t ledger_seq, std::function<void()> then) {
  busy_ = true;
  writing_ = true;
  num_changes_ = 0;
  checkpoint_s_ = MonotonicS();
  const bool final = state == submap_t::FINAL;
  if (final) final_due_s_ = HUGE_VAL;
  auto counted = std::make_shared<SubmapStatistics>(*statistics_);
  auto read = std::make_shared<std::function<Result<Bytes>()>>();
  RunOnSubmap(
      [final, counted, read](Submap& submap) {
        if (final) *counted = submap.Statistics();
        *read = StartEncoding(&submap, !final);
      },
      [this, counted, read, state, ledger_seq, then = std::move(then)] {
        busy_ = false;
        statistics_ = counted;
        StoreModel(*read, state, ledger_seq);
        then();
        Pump();
      });
}

void SubmapRun::StoreModel(const std::function<Result<Bytes>()>& read, int8_t state,
                           int64_t ledger_seq) {
  std::weak_ptr<bool> alive = alive_;
  threads_.writer.Run(
      [read, &blobs = node_.blobs()]() -> std::string {
        Result<Bytes> bytes = read();
        if (bytes.ok()) return blobs.Offer(std::move(*bytes));
        LogError("checkpoint: {}", bytes.error());
        return "";
      },
      [this, alive, state, ledger_seq](const std::string& blob) {
        if (alive.expired()) return;
        writing_ = false;
        if (blob.empty()) {
          TryModelAgain(state);
        } else {
          SubmitModel(state, ledger_seq, blob);
        }
      });
}

void SubmapRun::SubmitModel(int8_t state, int64_t ledger_seq, const std::string& blob) {
  submap_t fact = ToMessage(*statistics_);
  fact.num_images = num_images();
  fact.submap_id = submap_id_;
  fact.epoch = epoch_;
  fact.owner = node_.instance();
  fact.state = state;
  fact.model_blob = blob;
  fact.ledger_seq = ledger_seq;
  fact.memory_bytes = ResidentMemoryBytes();
  fact.header.fact_id = "submap/" + std::to_string(submap_id_) + "/" + std::to_string(epoch_) +
                        (state == submap_t::FINAL ? "/final/" : "/checkpoint/") +
                        std::to_string(++num_checkpoints_);
  Submit(
      fact, [](int64_t) {}, [this, state](const std::string&) { TryModelAgain(state); });
}

// When the period has passed.
void SubmapRun::TryModelAgain(int8_t state) {
  ++num_changes_;
  if (state == submap_t::FINAL) final_due_s_ = MonotonicS() + options_.checkpoint_period_s;
}

}  // namespace skein
