// The session in figures, for GET /metrics: docs/metrics.md lists them.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "session/heard_processes.h"
#include "session/session_history.h"
#include "session/session_tally.h"

namespace skein {

// Largest number of processes with series of their own.
constexpr size_t kMaxProcessSeries = 256;

struct DiskSpace {
  int64_t available_bytes = 0;
  int64_t size_bytes = 0;
};

struct MetricsInput {
  std::string session_id;
  const SessionRecord& session;
  const SessionTally& tally;
  const HeardProcesses& processes;      // heard within kSilentProcessS
  int64_t now_us = 0;                   // NowUs
  std::optional<int64_t> num_troubles;  // nullopt: not known
  std::optional<DiskSpace> disk;        // of the session folder; nullopt: not known
};

// Text for Prometheus (prometheus_text.h), seven lines a process. Counters never fall while the
// ledger lasts, also when the server starts again; those of a process begin at 0 with it. Time:
// O(submaps + merges + processes). Counts of photos come from `tally`. Label values are names of
// stages, steps and states, a fixed set, and names of processes: the first kMaxProcessSeries by
// name have series.
std::string MetricsText(const MetricsInput& input);

}  // namespace skein
