#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "ingest/work_queue.h"
#include "ledger/facts.h"
#include "session/session_history.h"

namespace skein {

// Plans the open work, by kind, derived from the ledger. An item is an image id, or a submap id.
//  - "features": photos without features.
//  - "matching": photos with candidates and without matches.
//  - "submap": seeds, and submaps without a mapper.
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

  // Takes up the work that is open in `session`, which must outlive it. `now_s` as in WorkQueue.
  WorkPlanner(const SessionRecord& session, double lease_s, double now_s);

  // `fact` was committed, in order; `session` is ahead of it or at it. A worker must not learn of a
  // fact before it is durable, so this goes by the facts.
  void OnFact(const Fact& fact, double now_s);
  std::vector<Failure> OnRequest(const std::string& kind, const WorkQueue::Request& request,
                                 double now_s);
  std::vector<Failure> OnFailed(const std::string& kind, const std::string& worker, int64_t item,
                                const std::string& reason, bool permanent, double now_s);
  void Return(const std::string& kind, const std::string& worker, int64_t item, double now_s);
  std::vector<Grant> Assign(double now_s);

  // Waiting items of a kind; 0 for an unknown kind.
  size_t NumWaiting(const std::string& kind) const;
  double lease_s() const { return lease_s_; }

 private:
  WorkQueue* Find(const std::string& kind);
  void AddOpenPhotos();
  void AddOpenSubmaps(double now_s);
  void NoteEarlierFailures();

  const SessionRecord& session_;
  const double lease_s_;
  std::map<std::string, WorkQueue> queues_;
};

}  // namespace skein
