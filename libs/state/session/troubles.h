// Troubles of a session until a person mends them: a full disk, processes that are missing, clocks
// that differ. One wording for the page, the phone, agents and `skein status`.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "session/heard_processes.h"
#include "session/session_state.h"

namespace skein {

// Heartbeats come once a second.
inline constexpr double kSilentProcessS = 5;

// `what` and `remedy` are whole sentences.
struct Trouble {
  std::string what;
  std::string remedy;
  std::string key;  // one for a trouble while its figures change, e.g. "none/features"
};

// Photos that wait for each stage before the mappers.
struct StageBacklog {
  int64_t features = 0;
  int64_t retrieval = 0;
  int64_t matching = 0;
};
StageBacklog BacklogOf(const SessionState& state);

// The trouble that a process tells (heartbeat_t.problem, which is not empty).
Trouble TroubleOf(const heartbeat_t& heartbeat);

// The trouble that ingest does not answer, and its consequence. Its key is kSilentIngest.
inline constexpr char kSilentIngest[] = "none/ingest";
Trouble IngestIsSilent();

// Whether a stage before the map's has no process that is heard. Else FindTroubles looks at no
// photo.
bool LacksWorker(const HeardProcesses& processes, double now_s);

// Worst first. `listened_s`: how long the heartbeats of `processes` have been listened to; of
// processes that were not heard, nothing is said before kSilentProcessS.
std::vector<Trouble> FindTroubles(const SessionState& state, const HeardProcesses& processes,
                                  double now_s, double listened_s);

// Whether FindTroubles tells more after kSilentProcessS of listening, if no other process is heard.
bool MayFindMore(const SessionState& state, const HeardProcesses& processes, double now_s,
                 double listened_s);

// [{what, remedy}]
nlohmann::json TroublesJson(const std::vector<Trouble>& troubles);

}  // namespace skein
