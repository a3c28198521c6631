// What seeds and merges are chosen from: the session's live submaps and the photos they share. It
// is a view of the session's state, but for one thing that is in no fact: how far each submap's
// mapper has worked. A mapper's status tells that every second, so a restart loses nothing.
#pragma once

#include <cstdint>
#include <map>
#include <utility>
#include <vector>

#include "session/session_state.h"

namespace skein {

struct LiveSubmap {
  int64_t submap_id = 0;
  const SubmapLife* state = nullptr;
  int64_t ledger_seq = 0;  // worked in up to here, by its latest epoch
};

class SubmapDirectory {
 public:
  // A pair of live submaps, smaller id first, and the photos that both hold.
  using Pair = std::pair<int64_t, int64_t>;

  // `session` must outlive it.
  explicit SubmapDirectory(const SessionState& session) : session_(session) {}

  const SessionState& session() const { return session_; }
  // A status of another epoch than the latest, or of an unknown submap, is dropped. A new epoch
  // starts where its checkpoint was: its position may be lower than the one before.
  void OnStatus(int64_t submap_id, int64_t epoch, int64_t ledger_seq);

  std::vector<LiveSubmap> Live() const;     // by id
  bool IsDeferred(int64_t image_id) const;  // deferred or withdrawn, by a live submap
  bool IsBusy(int64_t submap_id) const;     // in a merge that was ordered and is open
  int NumOpenMerges() const;
  // Pairs that share at least one photo.
  std::map<Pair, std::vector<int64_t>> SharedPhotos() const;

 private:
  struct Position {
    int64_t epoch = 0;
    int64_t ledger_seq = 0;
  };

  int64_t PositionOf(int64_t submap_id, const SubmapLife& submap) const;

  const SessionState& session_;
  std::map<int64_t, Position> positions_;
};

}  // namespace skein
