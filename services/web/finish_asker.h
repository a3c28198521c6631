// Asks ingest to finish the session, for an operator in a browser.
#pragma once

#include <cstdint>
#include <functional>
#include <map>

#include "core/result.h"
#include "node/node.h"

namespace skein {

// The command is repeated until the ledger has it. Loop's thread only.
class FinishAsker {
 public:
  using Done = std::function<void(Status)>;

  // `has_begun`: whether the ledger has the command.
  FinishAsker(Node& node, std::function<bool(int64_t command_id)> has_begun);
  ~FinishAsker();
  FinishAsker(const FinishAsker&) = delete;
  FinishAsker& operator=(const FinishAsker&) = delete;

  // `within_s`: seconds after which the finish is cut; 0: never. On a finish that runs: an earlier
  // deadline. Calls back once: Ok when the finish has begun, or is under way; kUnavailable where
  // ingest does not answer.
  void Ask(double within_s, Done done);

 private:
  void Tick();

  struct Asked {
    double within_s = 0;
    double since_s = 0;
    Done done;
  };

  Node& node_;
  const std::function<bool(int64_t)> has_begun_;
  std::map<int64_t, Asked> asked_;  // by command
  PollLoop::TimerId timer_ = 0;
};

}  // namespace skein
