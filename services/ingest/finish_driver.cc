#include "ingest/finish_driver.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "core/file.h"
#include "core/log.h"
#include "ingest/model_places.h"
#include "ingest/model_writer.h"
#include "ledger/fact_ids.h"
#include "session/read_session.h"
#include "session/report.h"
#include "session/submap_facts.h"

namespace skein {
namespace {

constexpr double kRetryWritingS = 5;
// A seed that no mapper takes for so long while the session finishes is given up.
constexpr double kNoMapperS = 30;
constexpr char kFinishVerb[] = "finish";

Status WriteModelsAndReport(const SessionPaths& paths, const std::vector<std::string>& model_blobs,
                            const PhotoPositions& positions, nlohmann::json report) {
  const Status status = WriteModels(paths, model_blobs);
  if (!status.ok()) return status;
  AddGeoreferences(paths, positions, &report);
  const std::string text = report.dump(2) + "\n";
  return WriteFileAtomic(paths.Report().string(), text.data(), text.size());
}

}  // namespace

FinishDriver::FinishDriver(Node& node, LedgerWriter& writer, SessionPaths paths, int min_model_size,
                           Environment environment)
    : node_(node),
      writer_(writer),
      paths_(std::move(paths)),
      min_model_size_(min_model_size),
      environment_(std::move(environment)),
      finish_of_command_(writer.history().finish_of_command()),
      done_(writer.history().finish_results()),
      worker_(node.loop()) {
  writer.AddObserver([this](const Fact& fact) {
    if (const auto* finish = std::get_if<finish_t>(&fact)) OnCommitted(*finish);
  });
}

void FinishDriver::OnCommitted(const finish_t& finish) {
  if (finish.state == finish_t::REQUESTED) {
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
  if (writer_.state().finishing()) {
    finish_of_command_[command.command_id] = writer_.state().finish().finish_id;
    return;
  }
  finish_t fact{};
  fact.header.fact_id = FinishRequestFactId(command.command_id);
  fact.header.author = node_.instance();
  fact.state = finish_t::REQUESTED;
  fact.detail = std::to_string(command.command_id);
  if (writer_.history().FindFact(fact.header.fact_id) == 0) writer_.Stage(fact);
}

void FinishDriver::Step(double now_s) {
  const FinishState& finish = writer_.state().finish();
  if (!writer_.state().finishing() || writing_ || writer_.has_staged()) return;
  EndSeedsWithoutMapper(now_s);
  if (finish.state == finish_t::REQUESTED) {
    Drain();
  } else if (finish.state == finish_t::SETTLED && AllFinal() && now_s >= retry_at_s_) {
    if (!EndSmallSubmaps()) WriteResults();
  }
}

void FinishDriver::Drain() {
  if (environment_.num_receiving() > 0 || writer_.state().num_in_flight() > 0) return;
  Stage(finish_t::DRAINED, "");
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
  if (waiting.empty() || environment_.has_idle_mapper()) no_mapper_since_s_ = now_s;
  if (no_mapper_since_s_ == 0) no_mapper_since_s_ = now_s;
  if (now_s - no_mapper_since_s_ < kNoMapperS) return;
  for (const int64_t id : waiting) {
    EndSubmap(id, 0, "no mapper was free for it; start more (launch.sh --mappers)");
  }
}

// A pair of photos says little of a place, and nothing checks it. True if there were any.
bool FinishDriver::EndSmallSubmaps() {
  const int64_t needed = std::min<int64_t>(min_model_size_, writer_.state().num_images());
  std::vector<std::pair<int64_t, int64_t>> small;  // submap, epoch
  for (const auto& [id, submap] : writer_.state().submaps()) {
    if (!submap.ended && submap.num_registered < needed) small.emplace_back(id, submap.lease.epoch);
  }
  for (const auto& [id, epoch] : small) {
    EndSubmap(id, epoch, "a model needs " + std::to_string(needed) + " photos (--min-model-size)");
  }
  return !small.empty();
}

void FinishDriver::EndSubmap(int64_t submap_id, int64_t epoch, const std::string& reason) {
  submap_end_t end = MakeSubmapEnd(submap_id, epoch, reason);
  end.header.author = node_.instance();
  writer_.Stage(end);
}

bool FinishDriver::AllFinal() const {
  const int64_t settled = writer_.state().finish().settled_seq;
  const auto& submaps = writer_.state().submaps();
  return std::all_of(submaps.begin(), submaps.end(), [&](const auto& entry) {
    return entry.second.ended || entry.second.final_ledger_seq >= settled;
  });
}

void FinishDriver::WriteResults() {
  std::vector<const SubmapLife*> live;
  for (const auto& [id, submap] : writer_.state().submaps()) {
    if (!submap.ended) live.push_back(&submap);
  }
  std::stable_sort(live.begin(), live.end(), [](const SubmapLife* a, const SubmapLife* b) {
    return a->latest_model->num_images > b->latest_model->num_images;
  });
  std::vector<std::string> blobs;
  for (const SubmapLife* submap : live) blobs.push_back(submap->latest_model->model_blob);
  const nlohmann::json report =
      MakeReport(writer_.session(), environment_.num_duplicates(), writer_.now_us());
  writing_ = true;
  worker_.Run([paths = paths_, blobs, positions = PositionsOf(writer_.state()),
               report] { return WriteModelsAndReport(paths, blobs, positions, report); },
              [this](const Status& status) { OnWritten(status); });
}

void FinishDriver::OnWritten(const Status& status) {
  writing_ = false;
  if (!status.ok()) {
    problem_ = "cannot write the models: " + status.error();
    retry_at_s_ = node_.loop().now_s() + kRetryWritingS;
    LogError("{}; trying again", problem_);
    return;
  }
  problem_.clear();
  Stage(finish_t::DONE, Summary());
}

std::string FinishDriver::Summary() const {
  const PhotoCounts counts = CountPhotos(writer_.session(), environment_.num_duplicates());
  const auto& submaps = writer_.state().submaps();
  const auto num_models = std::count_if(submaps.begin(), submaps.end(),
                                        [](const auto& entry) { return !entry.second.ended; });
  return std::to_string(counts.registered) + " of " + std::to_string(counts.received) +
         " photos registered, " + std::to_string(num_models) +
         (num_models == 1 ? " model in sparse/" : " models in sparse/");
}

std::string FinishDriver::Describe() const {
  if (!writer_.state().finishing()) return "";
  if (!problem_.empty()) return "finishing: " + problem_;
  switch (writer_.state().finish().state) {
    case finish_t::REQUESTED:
      return "finishing: waits for " +
             std::to_string(environment_.num_receiving() + writer_.state().num_in_flight()) +
             " photos";
    case finish_t::DRAINED:
      return "finishing: waits for the merger to settle";
    default:
      return writing_ ? "finishing: writing the models" : "finishing: waits for final models";
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
