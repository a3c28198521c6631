#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "mapper/ledger_index.h"
#include "mapper/merge_handler.h"
#include "mapper/submap_run.h"
#include "node/node.h"

namespace skein {

// Merges by the ledger: the source freezes and submits its model; the target absorbs a copy of it
// (merging/absorb.h verifies), takes the result over and says DONE, or says UNDONE with the reason
// and stays as it was. A target that replays an order which ended DONE absorbs again and says
// nothing.
class MergeExecutor : public MergeHandler {
 public:
  MergeExecutor(Node& node, const LedgerIndex& index) : node_(node), index_(index) {}

  void OnOrdered(const merge_t& ordered, SubmapRun& run, std::function<void()> resume) override;
  void OnMergeFact(const merge_t& merge, SubmapRun& run) override;
  void OnRunGone() override { open_ = Open(); }

 private:
  struct Open {
    merge_t ordered;
    std::function<void()> resume;
    bool absorbing = false;
    bool replay = false;
    double start_s = 0;
    std::shared_ptr<const colmap::Reconstruction> before;  // the target, before it absorbed
    std::vector<PhotoEvent> absorbed;                      // photos that are new in it
  };

  bool IsOpen(int64_t merge_id) const { return open_.resume && open_.ordered.merge_id == merge_id; }
  void Freeze(SubmapRun& run);
  void Absorb(const merge_t& frozen, SubmapRun& run);
  void OnSourceModel(Result<Bytes> bytes, SubmapRun& run);
  void OnAbsorbed(const std::string& reason, SubmapRun& run);
  void Conclude(int8_t state, const std::string& reason, SubmapRun& run);
  void OnEndRefused(int8_t state, const std::string& reason, SubmapRun& run);
  void Resume();
  // When a while has passed, unless the merge is over or the run gone by then.
  void Later(const SubmapRun& run, std::function<void()> then);
  merge_t MakeFact(int8_t state, const SubmapRun& run) const;

  Node& node_;
  const LedgerIndex& index_;
  Open open_;  // a submap is in one merge at a time
};

}  // namespace skein
