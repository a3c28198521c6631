#include "ingest/finish_driver.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <utility>
#include <vector>

#include "core/checksum_list.h"
#include "core/counted.h"
#include "core/file_below.h"
#include "core/log.h"
#include "event_loop/step_record.h"
#include "ledger/fact_ids.h"
#include "session/finish_cut.h"
#include "session/model_place.h"
#include "session/model_verdict.h"
#include "session/photo_homes.h"
#include "session/report.h"
#include "session/submap_facts.h"

namespace skein {
namespace {

constexpr double kRetryWritingS = 5;
constexpr int kResultsSlot = 2;  // the worker's
constexpr char kResultsStep[] = "results";
// A seed that no mapper takes for so long while the session finishes is given up.
constexpr double kNoMapperS = 30;
constexpr char kFinishVerb[] = "finish";
constexpr double kMaxWithinS = 1e9;
// With its fact it fits into one Ethernet frame.
constexpr size_t kMaxSummaryBytes = 800;

// A finish command's argument in seconds; 0: as long as it takes.
Result<double> ParseWithin(const std::string& argument) {
  if (argument.empty()) return 0.0;
  const char* end = argument.data() + argument.size();
  double seconds = 0;
  const auto read = std::from_chars(argument.data(), end, seconds);
  if (read.ec != std::errc() || read.ptr != end || !(seconds > 0) || seconds > kMaxWithinS) {
    return InvalidArgument("cannot finish within '" + ClampText(argument, 40) +
                           "' s: a positive number of seconds is needed");
  }
  return seconds;
}

int64_t Microseconds(double seconds) { return std::llround(seconds * 1e6); }

}  // namespace

FinishDriver::FinishDriver(Node& node, LedgerWriter& writer, SessionPaths paths,
                           const FinishOptions& options, Environment environment)
    : node_(node),
      writer_(writer),
      paths_(std::move(paths)),
      options_(options),
      environment_(std::move(environment)),
      finish_of_command_(writer.history().finish_of_command()),
      done_(writer.history().finish_results()),
      worker_(node.loop()) {
  writer.AddObserver([this](const Fact& fact) {
    if (const auto* finish = std::get_if<finish_t>(&fact)) OnCommitted(*finish);
  });
}

void FinishDriver::OnCommitted(const finish_t& finish) {
  if (finish.state == finish_t::REQUESTED) no_mapper_since_s_.reset();
  if (finish.state == finish_t::REQUESTED || finish.state == finish_t::DEADLINE) {
    finish_of_command_[std::atoll(finish.detail.c_str())] = finish.finish_id;
  } else if (finish.state == finish_t::DONE) {
    done_[finish.finish_id] = finish.detail;
    for (const auto& [command_id, finish_id] : finish_of_command_) {
      if (finish_id == finish.finish_id) Reply(command_id, true, finish.detail);
    }
  }
}

void FinishDriver::OnCommand(const command_t& command) {
  if (command.verb != kFinishVerb) return;
  const auto known = finish_of_command_.find(command.command_id);
  if (known != finish_of_command_.end()) {
    const auto done = done_.find(known->second);
    if (done != done_.end()) Reply(command.command_id, true, done->second);
    return;
  }
  const Result<double> within_s = ParseWithin(command.argument);
  if (!within_s.ok()) return Reply(command.command_id, false, within_s.error());
  const int64_t deadline_utime_us = *within_s > 0 ? writer_.now_us() + Microseconds(*within_s) : 0;
  writer_.state().finishing() ? Join(command, deadline_utime_us)
                              : Request(command, deadline_utime_us);
}

finish_t FinishDriver::MakeCommanded(int8_t state, const command_t& command,
                                     int64_t deadline_utime_us) const {
  finish_t fact{};
  fact.header.fact_id = FinishRequestFactId(command.command_id);
  fact.header.author = node_.instance();
  fact.state = state;
  fact.deadline_utime_us = deadline_utime_us;
  fact.detail = std::to_string(command.command_id);
  return fact;
}

void FinishDriver::Request(const command_t& command, int64_t deadline_utime_us) {
  const finish_t fact = MakeCommanded(finish_t::REQUESTED, command, deadline_utime_us);
  if (writer_.history().FindFact(fact.header.fact_id) == 0) writer_.Stage(fact);
}

// The fact also keeps a command that comes again later, after a restart, too, from beginning
// another finish.
void FinishDriver::Join(const command_t& command, int64_t deadline_utime_us) {
  const FinishState& finish = writer_.state().finish();
  const int64_t before_us = finish.deadline_utime_us;
  const bool is_earlier = before_us == 0 || deadline_utime_us < before_us;
  finish_t fact =
      MakeCommanded(finish_t::DEADLINE, command,
                    deadline_utime_us > 0 && is_earlier ? deadline_utime_us : before_us);
  fact.finish_id = finish.finish_id;
  if (writer_.history().FindFact(fact.header.fact_id) == 0) writer_.Stage(fact);
}

void FinishDriver::Step(double now_s) {
  stepped_s_ = now_s;
  if (!writer_.state().finishing() || writing_ || writer_.has_staged()) return;
  EndSeedsWithoutMapper(now_s);
  Advance(now_s);
}

void FinishDriver::Advance(double now_s) {
  const FinishState& finish = writer_.state().finish();
  if (finish.state == finish_t::SETTLED && (AllFinal() || IsGraceOver())) {
    if (now_s >= retry_at_s_ && !EndNeedlessSubmaps()) WriteResults();
  } else if (IsTimeUp()) {
    Stage(finish_t::CUT, "");
  } else if (finish.state == finish_t::REQUESTED) {
    Drain();
  } else if (finish.state == finish_t::DRAINED) {
    Settle();
  }
}

// For the first time.
bool FinishDriver::IsTimeUp() const {
  const FinishState& finish = writer_.state().finish();
  return finish.deadline_utime_us > 0 && !finish.is_cut() &&
         writer_.now_us() >= finish.deadline_utime_us;
}

// Mappers had the time to write what they have.
bool FinishDriver::IsGraceOver() const {
  const FinishState& finish = writer_.state().finish();
  return finish.is_cut() &&
         writer_.now_us() >= finish.cut_utime_us + Microseconds(options_.cut_grace_s);
}

void FinishDriver::Drain() {
  const bool in_work = environment_.num_receiving() > 0 || writer_.state().num_in_flight() > 0;
  if (!in_work || writer_.state().finish().is_cut()) Stage(finish_t::DRAINED, "");
}

// In the merger's place: no seed or merge may come any more.
void FinishDriver::Settle() {
  if (writer_.state().finish().is_cut()) Stage(finish_t::SETTLED, "");
}

void FinishDriver::Stage(int8_t state, const std::string& detail) {
  finish_t fact{};
  fact.finish_id = writer_.state().finish().finish_id;
  fact.header.fact_id = FinishFactId(fact.finish_id, state);
  fact.header.author = node_.instance();
  fact.state = state;
  fact.detail = detail;
  writer_.Stage(fact);
}

// With no mapper, or all of them full, a seed would wait for ever, and the finish with it.
void FinishDriver::EndSeedsWithoutMapper(double now_s) {
  std::vector<int64_t> waiting;
  for (const auto& [id, submap] : writer_.state().submaps()) {
    if (!submap.ended && submap.lease.epoch == 0) waiting.push_back(id);
  }
  if (waiting.empty() || environment_.has_idle_mapper()) return no_mapper_since_s_.reset();
  if (!no_mapper_since_s_) no_mapper_since_s_ = now_s;
  if (now_s - *no_mapper_since_s_ < kNoMapperS) return;
  for (const int64_t id : waiting) {
    EndSubmap(id, 0, "no mapper was free for it; start more (skein launch --mappers)");
  }
}

// A pair of photos says little of a place, and nothing checks it. A map whose photos are all in a
// larger one shows the place twice; where the finish is cut, the larger one's model may be older
// than these photos. True if there were any.
bool FinishDriver::EndNeedlessSubmaps() {
  const SessionState& state = writer_.state();
  const int64_t needed = std::min<int64_t>(options_.min_model_size, state.num_images());
  std::map<int64_t, std::string> needless;  // submap -> reason
  for (const auto& [id, submap] : state.submaps()) {
    if (submap.ended) continue;
    const int64_t holder = state.finish().is_cut() ? 0 : HolderOfAll(state, id);
    if (submap.num_registered < needed) {
      needless[id] = "a model needs " + std::to_string(needed) + " photos (--min-model-size)";
    } else if (holder != 0) {
      needless[id] = "map " + std::to_string(holder) + " holds all its photos";
    }
  }
  for (const auto& [id, reason] : needless) {
    EndSubmap(id, state.FindSubmap(id)->lease.epoch, reason);
  }
  return !needless.empty();
}

void FinishDriver::EndSubmap(int64_t submap_id, int64_t epoch, const std::string& reason) {
  submap_end_t end = MakeSubmapEnd(submap_id, epoch, reason);
  end.header.author = node_.instance();
  writer_.Stage(end);
}

// A cut finish doesn't wait for a mapper that is still to be found.
bool FinishDriver::AllFinal() const {
  const bool is_cut = writer_.state().finish().is_cut();
  const int64_t settled = writer_.state().finish().settled_seq;
  const auto& submaps = writer_.state().submaps();
  return std::all_of(submaps.begin(), submaps.end(), [&](const auto& entry) {
    const SubmapLife& submap = entry.second;
    return submap.ended || submap.final_ledger_seq >= settled ||
           (is_cut && submap.lease.epoch == 0);
  });
}

// Submaps with a model to write, largest first.
std::vector<const SubmapLife*> FinishDriver::Models() const {
  std::vector<const SubmapLife*> live;
  for (const auto& [id, submap] : writer_.state().submaps()) {
    if (!submap.ended && submap.latest_model) live.push_back(&submap);
  }
  std::stable_sort(live.begin(), live.end(), [](const SubmapLife* a, const SubmapLife* b) {
    return a->latest_model->num_images > b->latest_model->num_images;
  });
  return live;
}

WrittenModels FinishDriver::WriteModelsAndReport(const SessionPaths& paths,
                                                 const std::vector<submap_model_t>& models,
                                                 const nlohmann::json& report) {
  std::vector<std::string> blobs;
  for (const submap_model_t& model : models) blobs.push_back(model.model_blob);
  WrittenModels written = WriteModels(paths, blobs);
  if (!written.ok()) return written;
  const std::string text =
      report.dump(2, ' ', false, nlohmann::json::error_handler_t::replace) + "\n";
  written.status = WriteFileBelow(paths.root, paths.Report(), text.data(), text.size());
  if (!written.status.ok()) return written;
  const auto name = [](const std::filesystem::path& path) { return path.filename().string(); };
  written.status = WriteChecksumList(paths.root, name(paths.Results()),
                                     {name(paths.Sparse()), name(paths.Report())});
  return written;
}

nlohmann::json FinishDriver::MakeReportNow() const {
  nlohmann::json report =
      MakeReport(writer_.session(), environment_.num_duplicates(), writer_.now_us());
  if (report.contains("cut")) report["cut"]["not_received"] = environment_.num_receiving();
  return report;
}

void FinishDriver::WriteResults() {
  std::vector<submap_model_t> models;
  for (const SubmapLife* submap : Models()) models.push_back(*submap->latest_model);
  const nlohmann::json report = MakeReportNow();
  writing_ = true;
  worker_.Run(
      [&steps = node_.steps(), paths = paths_, models, report] {
        Result<WrittenModels> written = AttemptStep(&steps, kResultsSlot, {0, kResultsStep}, [&] {
          return WriteModelsAndReport(paths, models, report);
        });
        return written.ok() ? *std::move(written) : WrittenModels{written.status(), {}};
      },
      [this, models](const WrittenModels& written) { OnWritten(models, written); });
}

// Without the submaps whose models are damaged the results are written at the next step.
void FinishDriver::OnWritten(const std::vector<submap_model_t>& models,
                             const WrittenModels& written) {
  writing_ = false;
  if (!written.status.ok()) {
    problem_ = "cannot write the models: " + written.status.error();
    retry_at_s_ = stepped_s_ + kRetryWritingS;
    LogError("{}; trying again", problem_);
    return;
  }
  problem_.clear();
  for (const auto& [place, reason] : written.damaged) {
    const SubmapLife& submap = *writer_.state().FindSubmap(models[place].submap_id);
    LogError("submap {} ends: {}", models[place].submap_id, reason);
    if (!submap.ended) EndSubmap(models[place].submap_id, submap.lease.epoch, reason);
  }
  if (!written.damaged.empty()) return;
  Stage(finish_t::DONE, Summary());
}

std::string FinishDriver::Summary() const {
  const PhotoCounts counts = CountPhotos(writer_.session(), environment_.num_duplicates());
  const size_t num_models = Models().size();
  std::string text = std::to_string(counts.registered) + " of " + std::to_string(counts.received) +
                     " photos placed, " + Counted(num_models, "model") + " in sparse/";
  const SessionState& state = writer_.state();
  if (state.finish().is_cut()) {
    const int num_receiving = environment_.num_receiving();
    text += "; " + CutSummary(state, FindCut(state));
    if (num_receiving > 0) {
      text += "; photos not received in time: " + std::to_string(num_receiving);
    }
  }
  if (counts.registered < counts.received) {
    text += "; `skein status` and report.json tell of the others";
  }
  for (const auto& [id, submap] : state.submaps()) {
    const std::string verdict = submap.ended ? "" : VerdictOf(state, submap);
    if (!verdict.empty()) text += "\nmap " + std::to_string(id) + " " + verdict;
  }
  for (const auto& [id, submap] : state.submaps()) {
    const std::string sentence = submap.ended ? "" : PlaceSentenceOf(submap);
    if (!sentence.empty()) text += "\nmap " + std::to_string(id) + ": " + sentence;
  }
  return ClampText(text, kMaxSummaryBytes);
}

std::string FinishDriver::Describe() const {
  if (!writer_.state().finishing()) return "";
  if (!problem_.empty()) return "finishing: " + problem_;
  return (writer_.state().finish().is_cut() ? "finishing, its time is up: " : "finishing: ") +
         DescribeStage();
}

std::string FinishDriver::DescribeStage() const {
  switch (writer_.state().finish().state) {
    case finish_t::REQUESTED:
      return "waits for " +
             Counted(environment_.num_receiving() + writer_.state().num_in_flight(), "photo");
    case finish_t::DRAINED:
      return "waits for the merger to settle";
    default:
      return writing_ ? "writing the models" : "waits for final models";
  }
}

void FinishDriver::Reply(int64_t command_id, bool ok, const std::string& text) {
  command_reply_t reply{};
  reply.command_id = command_id;
  reply.ok = ok;
  reply.text = text;
  node_.Publish(kCommandReplyChannel, reply);
}

}  // namespace skein
