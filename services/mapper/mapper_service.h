#pragma once

#include <memory>

#include "event_loop/worker_thread.h"
#include "mapper/item_log.h"
#include "mapper/submap_run.h"
#include "node/ledger_follower.h"
#include "node/node.h"
#include "node/work_client.h"
#include "session/session_state.h"

namespace skein {

// Holds at most one leased submap; without one it follows the ledger and asks for the next.
// Loop's thread only.
class MapperService {
 public:
  // retire_after_s: ends the node after so long without a submap; 0: never.
  MapperService(Node& node, const SubmapRunOptions& options, double retire_after_s = 0);
  ~MapperService();

 private:
  void OnFact(const Fact& fact);
  void OnWork(const work_t& work);
  void OnEnd(SubmapRun::EndKind kind, const std::string& reason);
  void OnSharedRequest(const shared_request_t& request);
  void RetireWhenIdle();
  void FillHeartbeat(heartbeat_t* heartbeat) const;

  Node& node_;
  const SubmapRunOptions options_;
  const double retire_after_s_;
  SessionState session_;
  ItemLog items_;
  WorkerThread worker_;
  WorkerThread writer_;
  std::unique_ptr<SubmapRun> run_;
  std::unique_ptr<LedgerFollower> follower_;
  std::unique_ptr<WorkClient> work_;
  int64_t num_done_ = 0;
  double idle_since_s_;
  Bus::SubscriptionId shared_subscription_ = 0;
  PollLoop::TimerId timer_ = 0;
};

}  // namespace skein
