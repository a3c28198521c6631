#include "session/report.h"

#include <algorithm>
#include <array>
#include <vector>

#include "core/statistics.h"
#include "session/diagnosis.h"
#include "session/finish_cut.h"
#include "session/model_place.h"
#include "session/model_verdict.h"
#include "session/state_names.h"

namespace skein {
namespace {

using nlohmann::json;

double SecondsBetween(int64_t from_us, int64_t to_us) {
  return static_cast<double>(to_us - from_us) * 1e-6;
}

int64_t FirstReceived(const SessionState& state) {
  int64_t first = 0;
  for (const auto& [id, photo] : state.photos()) {
    const int64_t received = photo.image.received_utime_us;
    first = first == 0 ? received : std::min(first, received);
  }
  return first;
}

json ImagesPart(const PhotoCounts& counts, int64_t num_placements) {
  return {{"received", counts.received},     {"registered", counts.registered},
          {"deferred", counts.deferred},     {"failed", counts.failed},
          {"duplicates", counts.duplicates}, {"placements", num_placements}};
}

json SubmapsPart(const SessionState& state) {
  std::vector<std::pair<int64_t, const SubmapLife*>> live;
  for (const auto& [id, submap] : state.submaps()) {
    if (!submap.ended && submap.latest_model) live.push_back({id, &submap});
  }
  std::stable_sort(live.begin(), live.end(), [](const auto& a, const auto& b) {
    return a.second->latest_model->num_images > b.second->latest_model->num_images;
  });
  json submaps = json::array();
  for (const auto& [id, submap] : live) {
    const submap_model_t& model = *submap->latest_model;
    submaps.push_back({{"id", id},
                       {"images", model.num_images},
                       {"points", model.num_points},
                       {"mean_reprojection_error_px", model.mean_reprojection_error_px},
                       {"mean_track_length", model.mean_track_length},
                       {"check", CheckPart(state, *submap)},
                       {"georeference", GeoreferencePart(state, *submap)},
                       {"completeness", CompletenessPart(*submap)},
                       {"epoch", submap->lease.epoch}});
  }
  return submaps;
}

json MergesPart(const SessionState& state) {
  json merges = json::array();
  for (const auto& [id, merge] : state.merges()) {
    merges.push_back({{"id", id},
                      {"source", merge.ordered().source_id},
                      {"target", merge.ordered().target_id},
                      {"state", MergeStateName(merge.latest().state)},
                      {"reason", merge.latest().reason},
                      {"shared_images", merge.ordered().num_shared_images},
                      {"inlier_images", merge.ordered().num_inlier_images},
                      {"duration_s", merge.latest().duration_s},
                      {"since_evidence_s", SecondsBetween(merge.ordered().evidence_utime_us,
                                                          merge.latest().header.utime_us)}});
  }
  return merges;
}

json StagesPart(const StageTimes& times) {
  json stages = json::object();
  for (const auto& [stage, seconds] : times.by_stage) {
    const std::vector<double> samples(seconds.begin(), seconds.end());
    stages[stage] = {{"count", samples.size()},
                     {"mean_s", mean(samples)},
                     {"p95_s", percentile(samples, 95)},
                     {"max_s", percentile(samples, 100)}};
  }
  return stages;
}

json FailuresPart(const SessionHistory& history) {
  json failures = json::array();
  for (const failure_t& failure : history.Failures()) {
    failures.push_back({{"image", PhotoName(failure.agent, failure.name)},
                        {"stage", failure.stage},
                        {"reason", failure.reason},
                        {"attempts", failure.attempts}});
  }
  return failures;
}

json ImagesInTimePart(const SessionRecord& session) {
  const int64_t start = FirstReceived(session.state);
  json images = json::array();
  for (const auto& [id, photo] : session.state.photos()) {
    json image = {{"image", PhotoName(photo.image.agent, photo.image.name)},
                  {"received_s", SecondsBetween(start, photo.image.received_utime_us)},
                  {"registered_s", nullptr},
                  {"submap", nullptr}};
    if (const auto* first = session.history.FindFirstRegistration(id)) {
      image["registered_s"] = SecondsBetween(start, first->utime_us);
      image["submap"] = first->submap_id;
    }
    images.push_back(std::move(image));
  }
  return images;
}

// {"mapper": [{"instances": ["mapper-1"], "text": "...", "version": "0.1.0"}], ...}
json ConfigurationPart(const SessionHistory& history) {
  json services = json::object();
  for (const auto& [configuration, instances] : history.configurations()) {
    services[configuration.service].push_back({{"instances", instances},
                                               {"text", configuration.text},
                                               {"version", configuration.version}});
  }
  return services;
}

}  // namespace

json DeferredPart(const SessionState& state) {
  json deferred = json::array();
  for (const auto& [id, photo] : state.photos()) {
    if (photo.failed() || state.IsRegistered(id)) continue;
    const Diagnosis diagnosis = Diagnose(state, photo);
    deferred.push_back({{"image", PhotoName(photo.image.agent, photo.image.name)},
                        {"cause", CauseName(diagnosis.cause)},
                        {"reason", diagnosis.what},
                        {"remedy", diagnosis.remedy}});
  }
  return deferred;
}

PhotoCounts CountPhotos(const SessionRecord& session, int64_t num_duplicates) {
  const SessionState& state = session.state;
  PhotoCounts counts;
  counts.duplicates = num_duplicates;
  counts.received = state.num_images();
  for (const auto& [id, photo] : state.photos()) {
    const bool registered = state.IsRegistered(id);
    ++(registered ? counts.registered : photo.failed() ? counts.failed : counts.deferred);
  }
  counts.received += session.history.num_refused();
  counts.failed += session.history.num_refused();
  return counts;
}

std::vector<double> PhotoToPoseSeconds(const SessionRecord& session) {
  std::vector<double> seconds;
  for (const auto& [id, photo] : session.state.photos()) {
    const auto* first = session.history.FindFirstRegistration(id);
    if (first == nullptr) continue;
    seconds.push_back(SecondsBetween(photo.image.received_utime_us, first->utime_us));
  }
  return seconds;
}

json LatencyPart(const SessionRecord& session) {
  std::array<std::vector<double>, kPhotoStages.size()> spans, works;
  for (const auto& [id, path] : session.history.paths()) {
    const bool is_whole = std::all_of(path.end_utime_us.begin(), path.end_utime_us.end(),
                                      [](int64_t utime_us) { return utime_us != 0; });
    if (!is_whole) continue;
    int64_t from_us = path.received_utime_us;
    for (size_t i = 0; i < kPhotoStages.size(); ++i) {
      const double span_s = SecondsBetween(from_us, path.end_utime_us[i]);
      spans[i].push_back(span_s);
      works[i].push_back(std::min<double>(path.work_s[i], span_s));
      from_us = path.end_utime_us[i];
    }
  }
  json stages = json::array();
  for (size_t i = 0; i < kPhotoStages.size(); ++i) {
    const bool tells_work = i != static_cast<size_t>(PhotoStage::kIngest);
    const auto work = [&](double percent) {
      return tells_work ? json(percentile(works[i], percent)) : json(nullptr);
    };
    stages.push_back({{"stage", kPhotoStages[i]},
                      {"p50", percentile(spans[i], 50)},
                      {"p95", percentile(spans[i], 95)},
                      {"work_p50", work(50)},
                      {"work_p95", work(95)}});
  }
  const std::vector<double> latency = PhotoToPoseSeconds(session);
  return {{"p50", percentile(latency, 50)},
          {"p95", percentile(latency, 95)},
          {"p99", percentile(latency, 99)},
          {"stages", std::move(stages)}};
}

json RetrievalPart(const SessionHistory& history) {
  const RetrievalCounts& counts = history.retrieval();
  const auto found = history.times().by_stage.find("retrieval");
  const std::vector<float> none;
  const std::vector<float>& times = found == history.times().by_stage.end() ? none : found->second;
  return {{"candidates", counts.candidates},
          {"hits", counts.hits},
          {"pairs_matched", counts.pairs_matched},
          {"pairs_verified", counts.pairs_verified},
          {"mean_s", mean(std::vector<double>(times.begin(), times.end()))}};
}

json MakeReport(const SessionRecord& session, int64_t num_duplicates, int64_t done_utime_us) {
  const SessionState& state = session.state;
  const int64_t start = FirstReceived(state);
  json report = {{"format", "skein-report"},
                 {"version", 1},
                 {"images", ImagesPart(CountPhotos(session, num_duplicates),
                                       session.history.num_placements())},
                 {"submaps", SubmapsPart(state)},
                 {"merges", MergesPart(state)},
                 {"latency_s", LatencyPart(session)},
                 {"wall_s", start == 0 ? 0.0 : SecondsBetween(start, done_utime_us)},
                 {"finish_s", SecondsBetween(state.finish().requested_utime_us, done_utime_us)},
                 {"retrieval", RetrievalPart(session.history)},
                 {"stages", StagesPart(session.history.times())},
                 {"failures", FailuresPart(session.history)},
                 {"deferred", DeferredPart(state)},
                 {"images_in_time", ImagesInTimePart(session)},
                 {"configuration", ConfigurationPart(session.history)},
                 {"facts", state.head()}};
  if (state.finish().is_cut()) report["cut"] = CutPart(state, FindCut(state));
  return report;
}

}  // namespace skein
