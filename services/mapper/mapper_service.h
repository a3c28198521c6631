#pragma once

#include <atomic>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "event_loop/worker_thread.h"
#include "mapper/item_log.h"
#include "mapper/submap_run.h"
#include "mapper/submap_sharing.h"
#include "node/ledger_follower.h"
#include "node/node.h"
#include "node/work_client.h"
#include "session/session_state.h"

namespace skein {

// Holds leased submaps: one, and more where no other mapper is idle for them (SubmapSharing). All
// submaps share the worker's thread. Without a submap the service follows the ledger and asks for
// one. A run on which an exception comes at a fact or a tick ends: it counts against the submap's
// step TrialsStep, and the next run begins at the last checkpoint. Loop's thread only.
class MapperService {
 public:
  // retire_after_s: ends the node after so long without a submap; 0: never. share_after_s: see
  // SubmapSharing; only tests have another.
  MapperService(Node& node, const SubmapRunOptions& options, double retire_after_s = 0,
                double share_after_s = kShareAfterS);
  ~MapperService();

 private:
  void OnFact(const Fact& fact);
  void OnWork(const work_t& work);
  void OnEnd(const Lease& lease, const SubmapRun::Ending& ending);
  template <class Work>
  void ForEachRun(const Work& work);
  void OnSharedRequest(const shared_request_t& request);
  void UpdateCapacity();
  void RetireWhenIdle();
  int NumPhotos() const;
  std::string Describe() const;
  void FillHeartbeat(heartbeat_t* heartbeat) const;

  Node& node_;
  const SubmapRunOptions options_;
  const double retire_after_s_;
  SessionState session_;
  ItemLog items_;
  std::atomic<int64_t> current_{0};  // see MapperThreads
  WorkerThread worker_;
  WorkerThread writer_;
  ShapeDesk shapes_;
  std::map<int64_t, std::unique_ptr<SubmapRun>> runs_;  // by submap
  SubmapSharing sharing_;
  std::unique_ptr<LedgerFollower> follower_;
  std::unique_ptr<WorkClient> work_;
  int64_t num_done_ = 0;
  double idle_since_s_;
  bool retiring_ = false;
  std::vector<Bus::SubscriptionId> subscriptions_;
  std::vector<PollLoop::TimerId> timers_;
};

}  // namespace skein
