#include "web/status_message.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "core/statistics.h"
#include "session/guidance_json.h"
#include "session/report.h"
#include "session/state_names.h"
#include "web/diagnosis_json.h"
#include "web/events.h"

namespace skein {
namespace {

using nlohmann::json;

constexpr int kSecondsDigits = 4;

struct Agent {
  int64_t sent = 0, placed = 0, last_utime_us = 0;
};

json RoundedLatency(const SessionRecord& session) {
  const std::vector<double> seconds = PhotoToPoseSeconds(session);
  if (seconds.empty()) return {{"p50", nullptr}, {"p95", nullptr}, {"last", nullptr}};
  return {{"p50", Rounded(percentile(seconds, 50), kSecondsDigits)},
          {"p95", Rounded(percentile(seconds, 95), kSecondsDigits)},
          {"last", Rounded(seconds.back(), kSecondsDigits)}};
}

json ProcessesPart(const HeardProcesses& processes, double now_s) {
  json part = json::array();
  for (const auto& [instance, process] : processes) {
    part.push_back({{"instance", instance},
                    {"state", process.heartbeat.state},
                    {"backlog", process.heartbeat.backlog},
                    {"memory", process.heartbeat.memory_bytes},
                    {"seen_s", std::round(now_s - process.heard_s)}});
  }
  return part;
}

// Of the newest photos that are in no map, at most.
constexpr size_t kMaxDiagnoses = 200;

// Not those whose turn comes.
json DiagnosesPart(const SessionState& state) {
  json part = json::array();
  for (auto photo = state.photos().rbegin(); photo != state.photos().rend(); ++photo) {
    if (part.size() == kMaxDiagnoses) break;
    if (state.IsRegistered(photo->first)) continue;
    const Diagnosis diagnosis = Diagnose(state, photo->second);
    if (diagnosis.cause == Diagnosis::Cause::kWaiting) continue;
    part.push_back(DiagnosisJson(state, photo->second, diagnosis));
    part.back()["image"] = photo->first;
  }
  return part;
}

json GuidancePart(const SessionState& state, const HeardGuidance& guidance) {
  json part = json::array();
  for (const auto& [submap_id, place] : guidance.places) {
    if (state.IsLive(submap_id)) part.push_back(GuidanceJson(place));
  }
  return part;
}

json AdvicePart(const SessionState& state, const HeardGuidance& guidance) {
  json part = json::array();
  for (const auto& [agent, advice] : guidance.advice) {
    if (state.IsLive(advice.submap_id)) part.push_back(AdviceJson(advice));
  }
  return part;
}

}  // namespace

std::string StatusMessage(const SessionRecord& session, const HeardProcesses& processes,
                          double now_s, const std::vector<Trouble>& troubles,
                          const HeardGuidance& guidance) {
  const SessionState& state = session.state;
  int64_t described = 0, registered = 0;
  const StageBacklog backlog = BacklogOf(state);
  int64_t for_mapper = 0;
  std::map<std::string, Agent> agents;
  for (const auto& [id, photo] : state.photos()) {
    const bool is_registered = state.IsRegistered(id);
    described += photo.features_seq > 0 ? 1 : 0;
    registered += is_registered ? 1 : 0;
    Agent& agent = agents[photo.image.agent];
    ++agent.sent;
    agent.placed += is_registered ? 1 : 0;
    agent.last_utime_us = std::max(agent.last_utime_us, photo.image.received_utime_us);
  }
  for (const auto& [instance, process] : processes) {
    if (process.heartbeat.service == "mapper") for_mapper += process.heartbeat.backlog;
  }
  const PhotoCounts counts = CountPhotos(session, 0);
  json agents_part = json::array();
  for (const auto& [name, agent] : agents) {
    agents_part.push_back({{"agent", name},
                           {"sent", agent.sent},
                           {"placed", agent.placed},
                           {"last_utime_us", agent.last_utime_us}});
  }
  json finish = nullptr;
  if (state.finish().finish_id != 0) {
    finish = {{"finish", state.finish().finish_id},
              {"state", state.finish().is_cut() ? "cut" : FinishStateName(state.finish().state)}};
  }
  return json({{"type", "status"},
               {"photos",
                {{"received", counts.received},
                 {"described", described},
                 {"matched", state.num_matched()},
                 {"registered", registered},
                 {"waiting", counts.deferred},
                 {"failed", counts.failed}}},
               {"backlog",
                {{"features", backlog.features},
                 {"retrieval", backlog.retrieval},
                 {"matching", backlog.matching},
                 {"mapper", for_mapper}}},
               {"troubles", TroublesJson(troubles)},
               {"diagnoses", DiagnosesPart(state)},
               {"guidance", GuidancePart(state, guidance)},
               {"advice", AdvicePart(state, guidance)},
               {"latency", RoundedLatency(session)},
               {"agents", std::move(agents_part)},
               {"processes", ProcessesPart(processes, now_s)},
               {"finish", std::move(finish)}})
      .dump(-1, ' ', false, json::error_handler_t::replace);
}

}  // namespace skein
