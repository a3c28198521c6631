// Makes a damaged session folder whole.
//
// Damaged files go to DIR/damaged/. A photo comes back from its second copy. If facts, or blobs
// that facts need, are lost, the ledger is rewritten: photos, features, candidates and matches
// that are whole keep their place. Maps go: the mappers make them again from the matches, as after
// a finish. The services restore everything else that is lacking.
#pragma once

#include <string>
#include <vector>

#include "clients/store/session_check.h"
#include "core/result.h"
#include "ledger/session_folder.h"

namespace skein {

struct Repaired {
  std::vector<std::string> done;            // a line each, for a person; empty: it was whole
  std::vector<std::string> photos_to_send;  // AGENT/NAME, that are nowhere any more
  bool services_must_run = false;           // to restore what was taken out
};

// Fails, and leaves the folder as it is, while an ingest runs on it.
Result<Repaired> RepairSession(const SessionPaths& paths, const Progress& progress = {});

// The facts of a rewritten ledger: those that can be kept, numbered from 1.
std::vector<Fact> KeepFacts(const SessionCheck& check);

}  // namespace skein
