#include "session/troubles.h"

#include <algorithm>
#include <array>

#include "core/counted.h"
#include "session/session_tally.h"

namespace skein {
namespace {

// Signed messages are refused, and invitations end, by the receiver's clock.
constexpr int64_t kMaxClockDifferenceUs = 5'000'000;
constexpr std::array<const char*, 4> kStages = {"features", "retrieval", "matching", "mapper"};

bool IsHeard(const HeardProcess& process, double now_s) {
  return now_s - process.heard_s <= kSilentProcessS;
}

bool RunsAny(const HeardProcesses& processes, const std::string& service, double now_s) {
  for (const auto& [instance, process] : processes) {
    if (process.heartbeat.service == service && IsHeard(process, now_s)) return true;
  }
  return false;
}

// "3 photos wait for their features"
std::string WaitingPhotos(const std::string& service, int64_t count) {
  const std::string photos = Counted(count, "photo") + (count == 1 ? " waits " : " wait ");
  const std::string its = count == 1 ? "its " : "their ";
  if (service == "features") return photos + "for " + its + "features";
  if (service == "retrieval") return photos + "to be compared with the others";
  if (service == "matching") return photos + "for " + its + "matches";
  return photos + "to be placed in a map";
}

int64_t NumWaitingForMappers(const SessionState& state) {
  int64_t count = 0;
  for (const auto& [id, photo] : state.photos()) {
    count += PhaseOf(state, id, photo) == PhotoPhase::kMapper ? 1 : 0;
  }
  return count;
}

int64_t NumWaitingFor(const std::string& service, const SessionState& state) {
  if (service == "mapper") return NumWaitingForMappers(state);
  const StageBacklog backlog = BacklogOf(state);
  if (service == "features") return backlog.features;
  return service == "retrieval" ? backlog.retrieval : backlog.matching;
}

Trouble NoWorker(const std::string& service, int64_t num_waiting) {
  const std::string join =
      service == "retrieval" ? "" : ", or let another computer help (`skein launch --join`)";
  return {WaitingPhotos(service, num_waiting) + ", and no skein-" + service + " is running.",
          "Start `skein launch` on the session's folder again" + join +
              ". What was sent is kept, and goes on then.",
          "none/" + service};
}

Trouble ClockApart(const HeardProcess& process) {
  const auto seconds = std::llabs(process.clock_ahead_us) / 1'000'000;
  return {"The clock of " + process.heartbeat.host + " is " + std::to_string(seconds) + " s " +
              (process.clock_ahead_us > 0 ? "ahead." : "behind."),
          "Set the clocks of all computers of the session by the network, then start `skein "
          "launch` on " +
              process.heartbeat.host + " again.",
          "clock/" + process.heartbeat.host};
}

}  // namespace

StageBacklog BacklogOf(const SessionState& state) {
  StageBacklog backlog;
  for (const auto& [id, photo] : state.photos()) {
    if (photo.failed()) continue;
    backlog.features += photo.features_seq == 0 ? 1 : 0;
    backlog.retrieval += photo.features_seq > 0 && photo.candidates_seq == 0 ? 1 : 0;
    backlog.matching += photo.candidates_seq > 0 && photo.matches_seq == 0 ? 1 : 0;
  }
  return backlog;
}

// People know the session; other services are named, as `skein scale`.
Trouble TroubleOf(const heartbeat_t& heartbeat) {
  const size_t line_end = heartbeat.problem.find('\n');
  const std::string service = heartbeat.service == "ingest" ? "" : " (" + heartbeat.service + ")";
  return {"On " + heartbeat.host + service + ": " + heartbeat.problem.substr(0, line_end) + ".",
          line_end == std::string::npos
              ? "Once that is mended all goes on by itself, and nothing that was sent is lost."
              : heartbeat.problem.substr(line_end + 1) + ".",
          "problem/" + heartbeat.instance};
}

Trouble IngestIsSilent() {
  return {"The session does not answer: no photo is taken in.",
          "Start `skein launch` on the session's folder again. Until then photos stay where they "
          "were taken, and none is lost.",
          kSilentIngest};
}

bool LacksWorker(const HeardProcesses& processes, double now_s) {
  return std::any_of(kStages.begin(), kStages.end(),
                     [&](const char* service) { return !RunsAny(processes, service, now_s); });
}

std::vector<Trouble> FindTroubles(const SessionState& state, const HeardProcesses& processes,
                                  double now_s, double listened_s) {
  std::vector<Trouble> troubles;
  for (const auto& [instance, process] : processes) {
    const bool has_problem = IsHeard(process, now_s) && !process.heartbeat.problem.empty();
    if (has_problem) troubles.push_back(TroubleOf(process.heartbeat));
  }
  if (listened_s >= kSilentProcessS) {
    if (!RunsAny(processes, "ingest", now_s)) troubles.push_back(IngestIsSilent());
    // Photos are counted only where nobody works on them: this is asked once a second.
    for (const char* service : kStages) {
      if (RunsAny(processes, service, now_s)) continue;
      const int64_t num_waiting = NumWaitingFor(service, state);
      if (num_waiting > 0) troubles.push_back(NoWorker(service, num_waiting));
    }
  }
  for (const auto& [instance, process] : processes) {
    const bool is_apart = std::llabs(process.clock_ahead_us) > kMaxClockDifferenceUs;
    if (is_apart && IsHeard(process, now_s)) troubles.push_back(ClockApart(process));
  }
  return troubles;
}

bool MayFindMore(const SessionState& state, const HeardProcesses& processes, double now_s,
                 double listened_s) {
  return listened_s < kSilentProcessS &&
         FindTroubles(state, processes, now_s, kSilentProcessS).size() >
             FindTroubles(state, processes, now_s, listened_s).size();
}

nlohmann::json TroublesJson(const std::vector<Trouble>& troubles) {
  nlohmann::json part = nlohmann::json::array();
  for (const Trouble& trouble : troubles) {
    part.push_back({{"what", trouble.what}, {"remedy", trouble.remedy}});
  }
  return part;
}

}  // namespace skein
