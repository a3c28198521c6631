// Which two submaps to join next, and what was tried already. Everything is recovered from the
// ledger: an attempt is known by the number of shared photos it had.
//
// Smaller into larger; if that fails, the other way round. If both fail, the pair waits for more
// shared photos (SfM on-the-fly v2, section 3.4). A submap takes part in one merge at a time.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "core/result.h"
#include "merger/submap_directory.h"

namespace skein {

struct MergeOptions {
  bool enabled = true;
  int min_shared_images = 3;          // N_si
  int min_shared_when_finishing = 1;  // nothing more can come then
  // After so many failures of a pair, more new shared photos than one are asked for. Each attempt
  // costs the source its time, and visually similar places would have it stop all the time.
  int patient_failures = 4;
  double patient_growth = 1.5;

  Status Check() const;
};

struct MergeAttempt {
  int64_t source_id = 0;
  int64_t target_id = 0;
  std::vector<int64_t> shared_images;
  // Of the finish whose worked-over maps are tried, 0 before the first: tells a repeated attempt
  // from the earlier one.
  int64_t drained_seq = 0;
};

class MergePolicy {
 public:
  explicit MergePolicy(const MergeOptions& options) : options_(options) {}

  // The pair with most shared photos first; nullopt if there is nothing to do. Equal ledgers give
  // equal attempts.
  std::optional<MergeAttempt> Next(const SubmapDirectory& directory, bool finishing) const;

 private:
  using Direction = std::pair<int64_t, int64_t>;  // source, target
  struct Tried {
    int num_shared_images = 0;
    int num_failures = 0;
  };
  using Failures = std::map<Direction, Tried>;

  // What failed since the latest DRAINED: an UNDONE in its direction, a FAILED in both, as no
  // similarity was found in either. At DRAINED the mappers have worked over their maps with all
  // that the session has. What failed before may succeed now, and is tried once more.
  static Failures FailuresOf(const SessionState& session);
  bool WasTried(const Failures& failures, const Direction& direction, int num_shared_images,
                bool finishing) const;

  const MergeOptions options_;
};

}  // namespace skein
