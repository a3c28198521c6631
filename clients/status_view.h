// Output of `skein status`, from facts and heartbeats.
#pragma once

#include <cstdint>
#include <map>
#include <nlohmann/json.hpp>
#include <string>

#include "session/heard_processes.h"
#include "session/session_history.h"

namespace skein {

struct StatusInput {
  std::string session_id;
  const SessionRecord& session;
  const HeardProcesses& processes;
  const std::map<int64_t, submap_status_t>& submap_statuses;  // latest of SKEIN_SUBMAP_STATUS
  double now_s = 0;                                           // MonotonicS
  double listened_s = 0;                                      // to heartbeats
  std::map<int64_t, guidance_t> guidance = {};                // by submap, the latest
};

// Keys:
//
//   {session_id, ledger,
//    images{received, in_flight, registered, deferred, waiting, not_placed, failed},
//    troubles[{what, remedy}], latency_s{p50, p95, p99}, finishing,
//    instances[{instance, service, host, pid, state, backlog, done, mean_s, memory_bytes, ...}],
//    submaps[{id, owner, epoch, state, images, deferred, points, mean_reprojection_error_px,
//             guidance (GuidanceJson; null: not heard)}],
//    ended_submaps[{id, reason}], merges{done, undone, open, last_undone},
//    deferred[{image, cause, reason, remedy}] (not placed), failures[{image, stage, reason}]}
//
// received = registered + waiting + not_placed + failed. deferred = waiting + not_placed, as in
// report.json; Diagnose tells the two apart. in_flight counts photos that are not through matching:
// each is also counted as one of these outcomes.
nlohmann::json MakeStatus(const StatusInput& input);

// The same as a table of lines, for a terminal.
std::string FormatStatus(const nlohmann::json& status);

}  // namespace skein
