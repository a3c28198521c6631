#include "web/metrics.h"

#include <algorithm>
#include <array>
#include <set>
#include <utility>
#include <vector>

#include "core/version.h"
#include "photo/photo_name.h"
#include "web/prometheus_text.h"

namespace skein {
namespace {

constexpr MetricType kCounter = MetricType::kCounter, kGauge = MetricType::kGauge,
                     kHistogram = MetricType::kHistogram;

constexpr std::array<std::pair<const char*, PhotoPhase>, 4> kWaitedStages = {
    {{"features", PhotoPhase::kFeatures},
     {"retrieval", PhotoPhase::kRetrieval},
     {"matching", PhotoPhase::kMatching},
     {"mapper", PhotoPhase::kMapper}}};

double Count(int64_t count) { return static_cast<double>(count); }

void AddPhotos(const MetricsInput& input, PrometheusText* text) {
  const auto in = [&](PhotoPhase phase) { return Count(input.tally.NumIn(phase)); };
  text->Begin("skein_photos_accepted_total", kCounter, "Photos that the session has.");
  text->Add(Count(input.session.state.num_images()));
  text->Begin("skein_photo_bytes_total", kCounter, "Bytes of the accepted photos.");
  text->Add(Count(input.tally.photo_bytes()));
  text->Begin("skein_photos", kGauge,
              "Photos by state. Their sum is what came; in_flight, waiting and unplaced together "
              "are what report.json counts as deferred.");
  text->Add(in(PhotoPhase::kRegistered), {{"state", "registered"}});
  text->Add(in(PhotoPhase::kFeatures) + in(PhotoPhase::kRetrieval) + in(PhotoPhase::kMatching),
            {{"state", "in_flight"}});
  text->Add(in(PhotoPhase::kMapper), {{"state", "waiting"}});
  text->Add(in(PhotoPhase::kUnplaced), {{"state", "unplaced"}});
  text->Add(in(PhotoPhase::kFailed) + Count(input.session.history.num_refused()),
            {{"state", "failed"}});
  text->Begin("skein_placements_total", kCounter,
              "Registrations of a photo by a submap itself, each photo once a submap.");
  text->Add(Count(input.session.history.num_placements()));
  text->Begin("skein_photo_latency_seconds", kHistogram,
              "From a photo's receipt to the commit of its first pose.");
  const LatencyCounts& latency = input.tally.latency();
  text->AddHistogram(kLatencyBoundsS, latency.photos, latency.sum_s);
}

void AddBacklog(const MetricsInput& input, PrometheusText* text) {
  text->Begin("skein_stage_backlog", kGauge,
              "Photos that wait for a stage or are worked on there.");
  for (const auto& [stage, phase] : kWaitedStages) {
    text->Add(Count(input.tally.NumIn(phase)), {{"stage", stage}});
  }
  text->Begin("skein_stage_oldest_age_seconds", kGauge,
              "For how long the oldest photo of the stage's backlog has been there; 0: none is.");
  for (const auto& [stage, phase] : kWaitedStages) {
    const auto since_us = input.tally.OldestUtimeUs(phase);
    const double age_s = since_us ? Count(input.now_us - *since_us) * 1e-6 : 0;
    text->Add(std::max(age_s, 0.0), {{"stage", stage}});
  }
}

// A stage that has done nothing yet has a 0, so that rates begin with its first item.
void AddStages(const StageTimes& times, PrometheusText* text) {
  std::set<std::string> stages(kPhotoStages.begin(), kPhotoStages.end());
  stages.insert("merge");
  text->Begin("skein_stage_items_total", kCounter, "Items that a stage has done.");
  for (const std::string& stage : stages) {
    const auto found = times.by_stage.find(stage);
    const bool is_none = found == times.by_stage.end();
    text->Add(is_none ? 0 : static_cast<double>(found->second.size()), {{"stage", stage}});
  }
  text->Begin("skein_stage_seconds_total", kCounter,
              "Seconds of work on these items; matching's are summed over its threads.");
  for (const std::string& stage : stages) {
    const auto found = times.sum_s.find(stage);
    text->Add(found == times.sum_s.end() ? 0 : found->second, {{"stage", stage}});
  }
  text->Begin("skein_step_seconds_total", kCounter, "Seconds of a step of a stage's work.");
  for (const auto& [name, seconds] : times.sum_s) {
    const size_t dot = name.find('.');
    if (dot == std::string::npos) continue;
    text->Add(seconds, {{"stage", name.substr(0, dot)}, {"step", name.substr(dot + 1)}});
  }
}

void AddRetrieval(const RetrievalCounts& counts, PrometheusText* text) {
  text->Begin("skein_retrieval_candidates_total", kCounter,
              "Candidates that retrieval named, of photos through matching.");
  text->Add(Count(counts.candidates));
  text->Begin("skein_retrieval_hits_total", kCounter, "Candidates that matching verified.");
  text->Add(Count(counts.hits));
  text->Begin("skein_pairs_matched_total", kCounter, "Pairs of photos that were matched.");
  text->Add(Count(counts.pairs_matched));
  text->Begin("skein_pairs_verified_total", kCounter, "Pairs of photos that were verified.");
  text->Add(Count(counts.pairs_verified));
}

void AddSubmaps(const SessionState& state, PrometheusText* text) {
  int64_t live = 0, merged = 0, ended = 0, largest = 0, points = 0;
  for (const auto& [id, submap] : state.submaps()) {
    if (submap.ended) {
      ++(submap.merged_into != 0 ? merged : ended);
      continue;
    }
    ++live;
    largest = std::max(largest, submap.num_registered);
    points += submap.latest_model ? submap.latest_model->num_points : 0;
  }
  text->Begin("skein_submaps", kGauge, "Submaps by state; ended: for another reason than a merge.");
  text->Add(Count(live), {{"state", "live"}});
  text->Add(Count(merged), {{"state", "merged"}});
  text->Add(Count(ended), {{"state", "ended"}});
  text->Begin("skein_largest_submap_photos", kGauge, "Photos of the largest living submap.");
  text->Add(Count(largest));
  text->Begin("skein_model_points", kGauge, "Points of the newest models of living submaps.");
  text->Add(Count(points));
}

void AddMerges(const SessionState& state, PrometheusText* text) {
  int64_t done = 0, undone = 0, open = 0;
  for (const auto& [id, merge] : state.merges()) {
    done += merge.latest().state == merge_t::DONE ? 1 : 0;
    undone += merge.latest().state == merge_t::UNDONE ? 1 : 0;
    open += merge.is_open() ? 1 : 0;
  }
  text->Begin("skein_merges_total", kCounter,
              "Merges by result; failed: no similarity was found, and nothing was ordered.");
  text->Add(Count(done), {{"result", "done"}});
  text->Add(Count(undone), {{"result", "undone"}});
  text->Add(static_cast<double>(state.failed_merges().size()), {{"result", "failed"}});
  text->Begin("skein_merges_open", kGauge, "Merges that are under way.");
  text->Add(Count(open));
}

void AddLedger(const MetricsInput& input, PrometheusText* text) {
  const SessionState& state = input.session.state;
  text->Begin("skein_info", kGauge, "1, with the session's id and the version of skein-web.");
  text->Add(1, {{"session", input.session_id}, {"version", Version()}});
  text->Begin("skein_ledger_facts_total", kCounter, "Facts of the ledger.");
  text->Add(Count(state.head()));
  text->Begin("skein_ledger_last_fact_timestamp_seconds", kGauge,
              "When the last fact was committed, in seconds since 1970 UTC; 0: there is none.");
  text->Add(Count(state.last_utime_us()) * 1e-6);
  text->Begin("skein_finishes_total", kCounter, "Finishes that are done.");
  text->Add(static_cast<double>(input.session.history.finish_results().size()));
  text->Begin("skein_finish_running", kGauge, "1 while the session finishes, else 0.");
  text->Add(state.finishing() ? 1 : 0);
}

void AddWorkers(const HeardProcesses& processes, PrometheusText* text) {
  text->Begin("skein_workers", kGauge, "Processes of a stage that were heard in the last seconds.");
  for (const char* stage : kPhotoStages) {
    const auto is_of_stage = [&](const auto& process) {
      return process.second.heartbeat.service == stage;
    };
    text->Add(Count(std::count_if(processes.begin(), processes.end(), is_of_stage)),
              {{"stage", stage}});
  }
}

// A process and its labels.
struct ShownProcess {
  const heartbeat_t* heartbeat = nullptr;
  MetricLabels labels;
};

// Two series of one name would spoil the whole answer: of processes whose names look the same once
// they are printable, the first counts.
std::vector<ShownProcess> ShownProcesses(const HeardProcesses& processes) {
  std::vector<ShownProcess> shown;
  std::set<std::string> names;
  for (const auto& [instance, process] : processes) {
    const heartbeat_t& heartbeat = process.heartbeat;
    if (shown.size() == kMaxProcessSeries) break;
    const std::string name = Printable(instance);
    if (!names.insert(name).second) continue;
    shown.push_back({&heartbeat,
                     {{"process", name},
                      {"service", Printable(heartbeat.service)},
                      {"host", Printable(heartbeat.host)}}});
  }
  return shown;
}

void AddProcesses(const HeardProcesses& processes, PrometheusText* text) {
  const std::vector<ShownProcess> shown = ShownProcesses(processes);
  const auto add = [&](auto value) {
    for (const ShownProcess& process : shown) {
      text->Add(std::max(Count(value(*process.heartbeat)), 0.0), process.labels);
    }
  };
  text->Begin("skein_process_resident_memory_bytes", kGauge, "As the process tells it.");
  add([](const heartbeat_t& beat) { return beat.memory_bytes; });
  text->Begin("skein_process_peak_resident_memory_bytes", kGauge,
              "The most that it was so far, as the process tells it.");
  add([](const heartbeat_t& beat) { return beat.peak_memory_bytes; });
  text->Begin("skein_process_backlog", kGauge, "Items that wait in the process.");
  add([](const heartbeat_t& beat) { return beat.backlog; });
  text->Begin("skein_process_items_total", kCounter, "Items that it has done since it started.");
  add([](const heartbeat_t& beat) { return beat.num_done; });
  text->Begin("skein_process_pulled_bytes_total", kCounter, "Bytes of blobs that it has pulled.");
  add([](const heartbeat_t& beat) { return beat.bytes_pulled; });
  text->Begin("skein_process_undecodable_messages_total", kCounter,
              "Messages that it could not decode.");
  add([](const heartbeat_t& beat) { return beat.num_decode_failures; });
  text->Begin("skein_process_refused_messages_total", kCounter,
              "Messages that nobody signed, or whose signer may not say them.");
  add([](const heartbeat_t& beat) { return beat.num_refused; });
  text->Begin("skein_processes_without_series", kGauge,
              "Processes beyond those that have series here.");
  text->Add(static_cast<double>(processes.size() - shown.size()));
}

void AddHost(const MetricsInput& input, PrometheusText* text) {
  if (input.num_troubles) {
    text->Begin("skein_troubles", kGauge, "Troubles that a person has to mend: skein status.");
    text->Add(Count(*input.num_troubles));
  }
  if (!input.disk) return;
  text->Begin("skein_disk_available_bytes", kGauge, "Room left on the session folder's disk.");
  text->Add(Count(input.disk->available_bytes));
  text->Begin("skein_disk_size_bytes", kGauge, "Size of the session folder's disk.");
  text->Add(Count(input.disk->size_bytes));
}

}  // namespace

std::string MetricsText(const MetricsInput& input) {
  PrometheusText text;
  AddLedger(input, &text);
  AddPhotos(input, &text);
  AddBacklog(input, &text);
  AddStages(input.session.history.times(), &text);
  AddRetrieval(input.session.history.retrieval(), &text);
  AddSubmaps(input.session.state, &text);
  AddMerges(input.session.state, &text);
  AddWorkers(input.processes, &text);
  AddProcesses(input.processes, &text);
  AddHost(input, &text);
  return text.text();
}

}  // namespace skein
