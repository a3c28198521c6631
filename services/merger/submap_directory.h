// Directory of the session's live submaps and of how they overlap, from which seeds and merges are
// chosen. The directory is a view of the session's state, but for one thing that is in no fact: how
// far each submap's mapper has worked. A mapper's status tells that every second, so a restart
// loses nothing.
#pragma once

#include <cstdint>
#include <map>
#include <unordered_map>
#include <utility>
#include <vector>

#include "session/session_state.h"

namespace skein {

struct LiveSubmap {
  int64_t submap_id = 0;
  const SubmapLife* state = nullptr;
  int64_t ledger_seq = 0;  // worked in up to here, by its latest epoch
};

// The photos through which two submaps can be compared.
struct Overlap {
  std::vector<int64_t> shared;  // that both hold, by id
  std::vector<int64_t> linked;  // that one holds and the other should see, best first

  int size() const { return static_cast<int>(shared.size() + linked.size()); }
};

class SubmapDirectory {
 public:
  // Two live submaps, smaller id first.
  using Pair = std::pair<int64_t, int64_t>;

  // Epoch of a submap's mapper, and the ledger up to which that has worked.
  struct Position {
    int64_t epoch = 0;
    int64_t ledger_seq = 0;
  };

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
  using Overlaps = std::map<Pair, Overlap>;
  // Pairs with at least one such photo. A photo is linked with a submap by kMinLinkingInliers, over
  // all of its verified pairs with photos there. Visits all verified pairs when there are two
  // submaps, once a state of the session. Stands until the session has another fact.
  const Overlaps& FindOverlaps() const;

  // Adds to `images`, up to `num`, photos that one of the two submaps holds alone. The next photo
  // is the one with most inliers with earlier photos of its own submap, so it can follow them as a
  // guest.
  std::vector<int64_t> WithNeighbours(const Pair& pair, std::vector<int64_t> images, int num) const;

 private:
  int64_t PositionOf(int64_t submap_id, const SubmapLife& submap) const;
  Overlaps ComputeOverlaps() const;
  using Holders = std::unordered_map<int64_t, std::vector<int64_t>>;
  Holders HoldersOfPhotos() const;
  std::map<int64_t, int64_t> LinksOf(int64_t image_id, const std::vector<int64_t>& own,
                                     const Holders& holders) const;

  struct CachedOverlaps {
    int64_t head = -1;  // of the session
    Overlaps overlaps;
  };

  const SessionState& session_;
  std::map<int64_t, Position> positions_;
  mutable CachedOverlaps cached_;
};

}  // namespace skein
