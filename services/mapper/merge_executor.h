#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <utility>

#include "event_loop/alive.h"
#include "mapper/model_loader.h"
#include "merging/submap_merge.h"
#include "node/node.h"
#include "session/session_state.h"

namespace skein {

class SubmapRun;

// The part of a run's submap in merges, by the ledger. The source freezes and submits its model.
// The target absorbs a copy of it (merging/absorb.h verifies). If that passes, the result replaces
// the target's model, and the target submits DONE. Else its model stays as it was, and it submits
// UNDONE with the reason. A target that replays an order which ended DONE absorbs again and says
// nothing. If the other submap ends before, the order is abandoned: this one goes on as it was. At
// most two trips to the worker: to decode the source, which names the photos to fetch, and to
// absorb it. Loop's thread only; a part of the run.
class MergeExecutor {
 public:
  MergeExecutor(Node& node, const SessionState& session, SubmapRun& run)
      : node_(node), session_(session), run_(run) {}

  // The run rests until the merge is over, whatever waits; then its OnMergeOver is called. A source
  // whose merge ends DONE rests until it ends.
  void OnOrdered(const merge_t& ordered);
  // A further fact of a merge.
  void OnMergeFact(const merge_t& merge);
  void OnSubmapEnd();

  // The finish is cut: a target that has not begun to absorb stays as it is.
  void GiveUp();

  // The order being carried out; null if there is none.
  const merge_t* ordered() const { return open_ ? &open_->ordered : nullptr; }

 private:
  struct Open {
    merge_t ordered;
    bool absorbing = false;
    int64_t source_epoch = 0;  // in which it froze
    bool replay = false;
    double start_s = 0;
    Absorption absorption;
  };

  bool IsOpen(int64_t merge_id) const { return open_ && open_->ordered.merge_id == merge_id; }
  bool IsAbandoned() const { return session_.FindMerge(open_->ordered.merge_id)->abandoned; }
  std::string Step() const;
  void LeaveOut();
  void Freeze();
  void SubmitFrozen(const std::string& model_blob);
  void Absorb(const merge_t& frozen);
  void OnSource(const LoadedModel& source);
  MergeOrder Order() const;
  void OnAbsorbed();
  void Fail(const std::string& reason);
  void Conclude(int8_t state, const std::string& reason);
  void OnEndRefused(int8_t state, const std::string& reason);
  void GoBack(const std::string& reason);
  void Close();
  // `then`, but nothing once this merge is over or the run is gone.
  template <class Then>
  auto WhileOpen(Then then) const {
    return alive_.Guarded(
        [this, merge_id = open_->ordered.merge_id, then = std::move(then)](auto&&... arguments) {
          if (IsOpen(merge_id)) then(std::forward<decltype(arguments)>(arguments)...);
        });
  }
  void Later(std::function<void()> then);
  merge_t MakeFact(int8_t state) const;

  Node& node_;
  const SessionState& session_;
  SubmapRun& run_;
  std::optional<Open> open_;  // a submap is in one merge at a time
  Alive alive_;
};

}  // namespace skein
