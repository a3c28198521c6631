#include "clients/status_view.h"

#include <cmath>
#include <cstdio>
#include <utility>

#include "photo/photo_name.h"
#include "session/diagnosis.h"
#include "session/guidance_json.h"
#include "session/model_verdict.h"
#include "session/report.h"
#include "session/troubles.h"

namespace skein {
namespace {

using nlohmann::json;

constexpr size_t kMaxPhotosShown = 12;
constexpr double kMegabyte = 1e6;

json TroublesOf(const StatusInput& input) {
  json troubles = TroublesJson(
      FindTroubles(input.session.state, input.processes, input.now_s, input.listened_s));
  for (json& trouble : troubles) {
    for (const char* key : {"what", "remedy"}) {
      trouble[key] = Printable(trouble[key].get<std::string>(), 400);
    }
  }
  return troubles;
}

// From its birth to its end, for a person. `live`: what its mapper tells, null if nothing yet.
std::string SubmapStage(const SessionState& state, const SubmapLife& submap,
                        const submap_status_t* live) {
  if (const MergeState* merge = state.FindMerge(submap.open_merge_id)) {
    const merge_t& ordered = merge->ordered();
    return &submap == state.FindSubmap(ordered.source_id)
               ? "merging into " + std::to_string(ordered.target_id)
               : "absorbing " + std::to_string(ordered.source_id);
  }
  const int64_t epoch = submap.lease.epoch;
  if (epoch == 0) return "waits for a mapper";
  if (live == nullptr) return epoch == 1 ? "being born" : "changing hands";
  if (live->num_images == 0) return epoch == 1 ? "being born" : "being restored";
  const bool final = submap.latest_model && submap.latest_model->kind == submap_model_t::FINAL;
  return final ? "final" : "growing";
}

json ImagesOf(const SessionRecord& session, int64_t num_not_placed) {
  const PhotoCounts counts = CountPhotos(session, 0);
  return {{"received", counts.received},
          {"in_flight", session.state.num_in_flight()},
          {"registered", counts.registered},
          {"deferred", counts.deferred},
          {"waiting", counts.deferred - num_not_placed},
          {"not_placed", num_not_placed},
          {"failed", counts.failed}};
}

json InstancesOf(const StatusInput& input) {
  json instances = json::array();
  for (const auto& [name, heard] : input.processes) {
    const heartbeat_t& beat = heard.heartbeat;
    instances.push_back({{"instance", Printable(name)},
                         {"service", Printable(beat.service)},
                         {"host", Printable(beat.host)},
                         {"pid", beat.pid},
                         {"state", Printable(beat.state, 200)},
                         {"backlog", beat.backlog},
                         {"done", beat.num_done},
                         {"mean_s", std::isfinite(beat.mean_s) ? beat.mean_s : 0.f},
                         {"memory_bytes", beat.memory_bytes},
                         {"peak_memory_bytes", beat.peak_memory_bytes},
                         {"bytes_pulled", beat.bytes_pulled},
                         {"decode_failures", beat.num_decode_failures},
                         {"refused", beat.num_refused},
                         {"silent_s", input.now_s - heard.heard_s}});
  }
  return instances;
}

// Of a status or a model.
template <class T>
void SetFigures(const T& source, json* submap) {
  (*submap)["images"] = source.num_images;
  (*submap)["deferred"] = source.num_deferred;
  (*submap)["points"] = source.num_points;
  (*submap)["mean_reprojection_error_px"] = source.mean_reprojection_error_px;
}

// Live figures where the mapper tells them, else those of the last model.
json SubmapsOf(const StatusInput& input) {
  json submaps = json::array();
  for (const auto& [id, submap] : input.session.state.submaps()) {
    if (submap.ended) continue;
    const auto live = input.submap_statuses.find(id);
    const bool is_live =
        live != input.submap_statuses.end() && live->second.epoch == submap.lease.epoch;
    const submap_status_t* status = is_live ? &live->second : nullptr;
    json shown = {{"id", id},
                  {"owner", Printable(submap.lease.owner)},
                  {"epoch", submap.lease.epoch},
                  {"state", SubmapStage(input.session.state, submap, status)},
                  {"verdict", Printable(VerdictOf(input.session.state, submap), 400)}};
    const auto guidance = input.guidance.find(id);
    shown["guidance"] =
        guidance == input.guidance.end() ? json(nullptr) : GuidanceJson(guidance->second);
    if (status != nullptr) {
      SetFigures(*status, &shown);
    } else {
      SetFigures(submap.latest_model.value_or(submap_model_t{}), &shown);
    }
    submaps.push_back(std::move(shown));
  }
  return submaps;
}

json EndedOf(const SessionState& state) {
  json ended = json::array();
  for (const auto& [id, submap] : state.submaps()) {
    if (submap.ended) ended.push_back({{"id", id}, {"reason", Printable(submap.end_reason, 200)}});
  }
  return ended;
}

json MergesOf(const SessionState& state) {
  int done = 0, undone = 0, open = 0;
  std::string last_undone;
  for (const auto& [id, merge] : state.merges()) {
    const int8_t last = merge.latest().state;
    done += last == merge_t::DONE;
    undone += last == merge_t::UNDONE;
    open += merge.is_open();
    if (last != merge_t::UNDONE) continue;
    last_undone = std::to_string(merge.ordered().source_id) + " into " +
                  std::to_string(merge.ordered().target_id) + ": " + merge.latest().reason;
  }
  return {{"done", done},
          {"undone", undone},
          {"open", open},
          {"last_undone", Printable(last_undone, 200)}};
}

json FailuresOf(const SessionHistory& history) {
  json failures = json::array();
  for (const failure_t& failure : history.Failures()) {
    failures.push_back({{"image", Printable(PhotoName(failure.agent, failure.name))},
                        {"stage", Printable(failure.stage)},
                        {"reason", Printable(failure.reason, 200)}});
  }
  return failures;
}

// Photos in no submap, without those whose turn comes.
json UnplacedOf(const SessionState& state) {
  json unplaced = json::array();
  for (const json& photo : DeferredPart(state)) {
    if (photo["cause"] == CauseName(Diagnosis::Cause::kWaiting)) continue;
    const std::string remedy = photo["remedy"];
    const std::string reason = photo["reason"];
    unplaced.push_back({{"image", Printable(photo["image"].get<std::string>())},
                        {"cause", photo["cause"]},
                        {"reason", Printable(reason, 200)},
                        {"remedy", Printable(remedy, 200)}});
  }
  return unplaced;
}

template <class... T>
std::string Line(const char* format, T... values) {
  char text[512];
  std::snprintf(text, sizeof(text), format, values...);
  return std::string(text) + "\n";
}

std::string FormatInstance(const json& i) {
  const double silent_s = i["silent_s"];
  std::string state = silent_s > kSilentProcessS
                          ? "silent for " + std::to_string(static_cast<int>(silent_s)) + " s"
                          : i["state"].get<std::string>();
  const long long dropped = i["decode_failures"], refused = i["refused"];
  if (dropped > 0) state += "; messages of another type or damaged: " + std::to_string(dropped);
  if (refused > 0) state += "; messages unsigned or not allowed: " + std::to_string(refused);
  return Line("  %-14s %8d %8lld %9.3f %9.1f  %s", i["instance"].get<std::string>().c_str(),
              i["backlog"].get<int>(), i["done"].get<long long>(), i["mean_s"].get<double>(),
              i["memory_bytes"].get<double>() / kMegabyte, state.c_str());
}

std::string FormatSubmap(const json& s) {
  return Line("  %-6lld %-14s %6lld %-18s %7d %9d %9d %9.3f", s["id"].get<long long>(),
              s["owner"].get<std::string>().c_str(), s["epoch"].get<long long>(),
              s["state"].get<std::string>().c_str(), s["images"].get<int>(),
              s["deferred"].get<int>(), s["points"].get<int>(),
              s["mean_reprojection_error_px"].get<double>());
}

std::string FormatVerdict(const json& s) {
  const std::string verdict = s["verdict"];
  if (verdict.empty()) return "";
  return Line("  map %lld %s", s["id"].get<long long>(), verdict.c_str());
}

// How complete its place is.
std::string FormatGuidance(const json& s) {
  const json& guidance = s["guidance"];
  if (guidance.is_null()) return "";
  return Line("  map %lld: %s", s["id"].get<long long>(),
              Printable(guidance["sentence"].get<std::string>(), 200).c_str());
}

// Which submaps have gone where, and what was refused.
std::string FormatMerges(const json& merges, const json& ended) {
  if (ended.empty() && merges["done"] == 0 && merges["undone"] == 0 && merges["open"] == 0)
    return "";
  std::string text = Line("\nmerges  %d done, %d undone, %d under way", merges["done"].get<int>(),
                          merges["undone"].get<int>(), merges["open"].get<int>());
  for (const json& submap : ended) {
    text += Line("  map %lld: %s", submap["id"].get<long long>(),
                 submap["reason"].get<std::string>().c_str());
  }
  const std::string undone = merges["last_undone"];
  if (!undone.empty()) text += Line("  last undone: %s", undone.c_str());
  return text;
}

// "  seconds in each stage (median)   ingest 0.10   features 0.42 (work 0.36)   ..."
std::string FormatStages(const json& stages) {
  std::string text = "  seconds in each stage (median)";
  for (const json& stage : stages) {
    char part[80];
    std::snprintf(part, sizeof(part), "   %s %.2f", stage["stage"].get<std::string>().c_str(),
                  stage["p50"].get<double>());
    text += part;
    if (stage["work_p50"].is_null()) continue;
    std::snprintf(part, sizeof(part), " (work %.2f)", stage["work_p50"].get<double>());
    text += part;
  }
  return text + "\n";
}

// The last of a list of photos, each with what went wrong.
std::string FormatPhotos(const json& photos) {
  std::string text;
  const size_t hidden = photos.size() > kMaxPhotosShown ? photos.size() - kMaxPhotosShown : 0;
  for (size_t i = hidden; i < photos.size(); ++i) {
    const json& photo = photos[i];
    text += "  " + photo["image"].get<std::string>();
    if (photo.contains("stage")) text += " (" + photo["stage"].get<std::string>() + ")";
    text += ": " + photo["reason"].get<std::string>() + "\n";
    const std::string remedy = photo.value("remedy", "");
    if (!remedy.empty()) text += "      " + remedy + "\n";
  }
  if (hidden > 0) text += Line("  and %zu earlier", hidden);
  return text;
}

}  // namespace

json MakeStatus(const StatusInput& input) {
  const SessionState& state = input.session.state;
  json unplaced = UnplacedOf(state);
  return {{"session_id", input.session_id},
          {"ledger", state.head()},
          {"images", ImagesOf(input.session, static_cast<int64_t>(unplaced.size()))},
          {"troubles", TroublesOf(input)},
          {"latency_s", LatencyPart(input.session)},
          {"retrieval", RetrievalPart(input.session.history)},
          {"finishing", state.finishing()},
          {"instances", InstancesOf(input)},
          {"submaps", SubmapsOf(input)},
          {"ended_submaps", EndedOf(state)},
          {"merges", MergesOf(state)},
          {"deferred", std::move(unplaced)},
          {"failures", FailuresOf(input.session.history)}};
}

std::string FormatStatus(const json& status) {
  const json& images = status["images"];
  const json& latency = status["latency_s"];
  std::string text = Line("session %s%s", status["session_id"].get<std::string>().c_str(),
                          status["finishing"] ? "   finishing" : "");
  for (const json& trouble : status["troubles"]) {
    text += "! " + trouble["what"].get<std::string>() + "\n  " +
            trouble["remedy"].get<std::string>() + "\n";
  }
  text += Line("photos  %lld received: %lld placed, %lld waiting, %lld not placed, %lld failed",
               images["received"].get<long long>(), images["registered"].get<long long>(),
               images["waiting"].get<long long>(), images["not_placed"].get<long long>(),
               images["failed"].get<long long>());
  if (latency["p95"].get<double>() > 0) {
    text += Line(
        "from received to placed  half within %.2f s   95 %% within %.2f s   99 %% within %.2f s",
        latency["p50"].get<double>(), latency["p95"].get<double>(), latency["p99"].get<double>());
    text += FormatStages(latency["stages"]);
  }
  const json& retrieval = status["retrieval"];
  text += Line(
      "overlap  found in %.2f ms a photo   candidates: %lld, right: %lld   pairs of photos: %lld "
      "matched, %lld right",
      1e3 * retrieval["mean_s"].get<double>(), retrieval["candidates"].get<long long>(),
      retrieval["hits"].get<long long>(), retrieval["pairs_matched"].get<long long>(),
      retrieval["pairs_verified"].get<long long>());
  text += Line("\n  %-14s %8s %8s %9s %9s  %s", "process", "waiting", "done", "s each", "memory MB",
               "state");
  for (const json& instance : status["instances"]) text += FormatInstance(instance);
  if (!status["submaps"].empty()) {
    text += Line("\n  %-6s %-14s %6s %-18s %7s %9s %9s %9s", "map", "mapper", "epoch", "state",
                 "placed", "waiting", "points", "error px");
    for (const json& submap : status["submaps"]) text += FormatSubmap(submap);
    for (const json& submap : status["submaps"]) text += FormatVerdict(submap);
    for (const json& submap : status["submaps"]) text += FormatGuidance(submap);
  }
  text += FormatMerges(status["merges"], status["ended_submaps"]);
  if (!status["deferred"].empty()) text += "\nnot placed\n" + FormatPhotos(status["deferred"]);
  if (!status["failures"].empty()) text += "\nfailed\n" + FormatPhotos(status["failures"]);
  return text;
}

}  // namespace skein
