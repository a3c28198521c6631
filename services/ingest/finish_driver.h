#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "event_loop/worker_thread.h"
#include "ingest/ledger_writer.h"
#include "ingest/model_writer.h"
#include "ledger/session_folder.h"
#include "node/node.h"

namespace skein {

struct FinishOptions {
  int min_model_size = 3;   // photos; fewer where the session has fewer
  double cut_grace_s = 10;  // from CUT until the results are written with the models that are there
};

// Takes a session from the `finish` command to its models and report.
//  - REQUESTED: on the command.
//  - DRAINED: all photos are through matching.
//  - SETTLED: comes from the merger. Submaps that are too small to be a model end, and those whose
//    photos are all in a larger one.
//  - DONE: the final model of every living submap is written. A submap whose model cannot be read
//    ends, with the reason; its photos may be seeded again.
// A command may give seconds. When they are over the finish is CUT: it is DRAINED and SETTLED at
// once, and mappers write their models as they are. If a mapper does not do so within the grace,
// the newest model in the ledger is taken. The ledger holds where the finish stands, so a restart
// goes on. Loop's thread only.
class FinishDriver {
 public:
  struct Environment {
    std::function<int()> num_receiving;  // photos on their way in
    std::function<int()> num_duplicates;
    std::function<bool()> has_idle_mapper;
  };

  FinishDriver(Node& node, LedgerWriter& writer, SessionPaths paths, const FinishOptions& options,
               Environment environment);

  // A command asked before, whose finish is done, is answered again; while one runs, a further
  // command joins it, and may give it an earlier deadline.
  void OnCommand(const command_t& command);
  // Takes the next step if it can be taken; after every commit and at least once a second. `now_s`:
  // by which mappers are silent.
  void Step(double now_s);
  // For a person; "" if no finish runs.
  std::string Describe() const;
  const std::string& problem() const { return problem_; }  // for a person; "" if there is none

 private:
  static WrittenModels WriteModelsAndReport(const SessionPaths& paths,
                                            const std::vector<submap_model_t>& models,
                                            const nlohmann::json& report);
  void OnCommitted(const finish_t& finish);
  void Request(const command_t& command, int64_t deadline_utime_us);
  void Join(const command_t& command, int64_t deadline_utime_us);
  finish_t MakeCommanded(int8_t state, const command_t& command, int64_t deadline_utime_us) const;
  bool IsTimeUp() const;
  void Advance(double now_s);
  void Drain();
  void Settle();
  void EndSeedsWithoutMapper(double now_s);
  bool EndNeedlessSubmaps();
  void EndSubmap(int64_t submap_id, int64_t epoch, const std::string& reason);
  bool AllFinal() const;
  bool IsGraceOver() const;
  std::vector<const SubmapLife*> Models() const;
  nlohmann::json MakeReportNow() const;
  void WriteResults();
  void OnWritten(const std::vector<submap_model_t>& models, const WrittenModels& written);
  void Stage(int8_t state, const std::string& detail);
  void Reply(int64_t command_id, bool ok, const std::string& text);
  std::string Summary() const;
  std::string DescribeStage() const;

  Node& node_;
  LedgerWriter& writer_;
  const SessionPaths paths_;
  const FinishOptions options_;
  const Environment environment_;
  std::map<int64_t, int64_t> finish_of_command_;  // command id -> finish id
  std::map<int64_t, std::string> done_;           // finish id -> what was told
  bool writing_ = false;
  double stepped_s_ = 0, retry_at_s_ = 0;
  std::optional<double> no_mapper_since_s_;  // in this finish a seed has waited
  std::string problem_;
  WorkerThread worker_;  // last: ends first
};

}  // namespace skein
