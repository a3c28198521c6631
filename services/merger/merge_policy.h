// Chooses the next two submaps to join, and knows the attempts that were made. Everything is
// recovered from the ledger: an attempt is known by the number of photos it could be compared
// through.
//
// Smaller into larger; if that fails, the other way round. If both fail, the pair waits for half as
// many photos more (after SfM on-the-fly v2, section 3.4). A submap takes part in one merge at a
// time.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <vector>

#include "merger/submap_directory.h"

namespace skein {

constexpr int kMinSharedImages = 3;  // N_si of the paper; shared or linked

struct MergeAttempt {
  int64_t source_id = 0;
  int64_t target_id = 0;
  std::vector<int64_t> images;  // through which the two are compared
  int num_images = 0;           // shared and linked: the evidence
  // Sequence number of the latest DRAINED, after which the mappers have worked over their maps; 0
  // before the first.
  int64_t drained_seq = 0;
};

// Since when pairs of submaps could be compared, for figures alone: a restart forgets it.
class MergeEvidence {
 public:
  // The session's state is of `utime_us`.
  void Note(const SubmapDirectory::Overlaps& overlaps, int64_t utime_us);
  // Evidence of the source passes to the target.
  void OnMerged(int64_t source_id, int64_t target_id);
  // 0 if there is none.
  int64_t UtimeOf(int64_t submap_id1, int64_t submap_id2) const;

 private:
  std::map<SubmapDirectory::Pair, int64_t> since_utime_us_;
};

class MergePolicy {
 public:
  // `enabled`: false leaves all submaps apart.
  explicit MergePolicy(bool enabled) : enabled_(enabled) {}

  bool is_enabled() const { return enabled_; }

  // The pair with most such photos first; nullopt if there is nothing to do. Equal ledgers give
  // equal attempts.
  std::optional<MergeAttempt> Next(const SubmapDirectory& directory, bool finishing) const;

  // Whether the pair should be merged the other way round. The target compares the two once more,
  // through shared photos and guests of the source. `inliers`: the photos that agree with the
  // similarity. Some agree as guests of the source, which the target will not see.
  bool IsBetterReversed(const MergeAttempt& attempt, const std::vector<int64_t>& inliers,
                        const SubmapDirectory& directory) const;

 private:
  const bool enabled_;
};

}  // namespace skein
