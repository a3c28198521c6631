#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "ingest/work_queue.h"
#include "ledger/facts.h"
#include "session/session_state.h"

namespace skein {

// Which work there is, by kind, derived from the ledger: "features" (photos without features),
// "matching" (photos with candidates and without matches), "submap" (seeds and submaps without a
// mapper). An item is an image id, or a submap id.
class WorkPlanner {
 public:
  struct Grant {
    std::string kind;
    std::string worker;
    int64_t item = 0;
    int attempt = 1;
    bool is_new = false;  // a submap's first grant to this worker begins a new epoch
  };
  struct Failure {
    std::string kind;
    WorkQueue::Failure failure;
  };

  // `state` must outlive it and be ahead of or at the facts given to OnFact.
  WorkPlanner(const SessionState& state, LeaseOptions options);

  // Facts in order, from the first. `now_s` as in WorkQueue.
  void OnFact(const Fact& fact, double now_s);
  std::vector<Failure> OnRequest(const std::string& kind, const WorkQueue::Request& request,
                                 double now_s);
  std::vector<Failure> OnFailed(const std::string& kind, const std::string& worker, int64_t item,
                                const std::string& reason, bool permanent, double now_s);
  std::vector<Grant> Assign(double now_s);

  // Waiting items of a kind; 0 for an unknown kind.
  size_t NumWaiting(const std::string& kind) const;
  double lease_s() const { return options_.lease_s; }

 private:
  WorkQueue* Find(const std::string& kind);

  const SessionState& state_;
  const LeaseOptions options_;
  std::map<std::string, WorkQueue> queues_;
};

}  // namespace skein
