#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/result.h"
#include "ledger/facts.h"
#include "session/session_state.h"

namespace skein {

// Whether a submitted fact may be committed now: its image exists, its counts fit, its blobs are
// named. An error is the reason that the author is told. Doesn't look at whether the blobs are
// here, nor at repeats, nor at leases.
Status CheckSubmission(const Fact& fact, const SessionState& state);

// For a mapper's fact for a submap: registration, model, step of a merge. Ok while the submap lives
// and is leased to the author in the fact's epoch. Ok for all other facts.
Status CheckLease(const Fact& fact, const SessionState& state);

// A blob that a fact names, and what it can have at most by the fact's own figures and its kind.
struct NamedBlob {
  std::string blob_id;
  int64_t max_bytes = 0;
};
std::vector<NamedBlob> NamedBlobs(const Fact& fact);

// Fills what ingest decides at commit: seq, time, and the ids of new photos, submaps, merges and
// finishes.
void CompleteFact(Fact* fact, const SessionState& state, int64_t utime_us);

}  // namespace skein
