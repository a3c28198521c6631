// The guide's process: follows the ledger and the map snapshots (shapes) of the submaps, and tells
// how complete each place is and what each agent can photograph next.
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <string>

#include "event_loop/alive.h"
#include "event_loop/failed_items.h"
#include "event_loop/worker_thread.h"
#include "guide/guide_options.h"
#include "guide/place_guidance.h"
#include "guide/vain_advice.h"
#include "guide/work_share.h"
#include "node/ledger_follower.h"
#include "node/node.h"
#include "session/session_state.h"
#include "shapes/shape_follower.h"
#include "shapes/shape_store.h"

namespace skein {

// GuideService knows only what the ledger and the mappers tell, so it may die and return at any
// time; it then has forgotten which advice failed. An exception, a crash or a hang counts against
// the submap (event_loop/failed_items.h), of which nothing is told any more after the third. Loop's
// thread; guidance is worked out on another.
class GuideService {
 public:
  // Throws std::invalid_argument where options.no_go cannot be read.
  GuideService(Node& node, const GuideOptions& options);
  ~GuideService();
  GuideService(const GuideService&) = delete;
  GuideService& operator=(const GuideService&) = delete;

 private:
  struct Job {
    Result<PlaceGuidance> guidance;
    double seconds;
  };

  ShapeFollowerOptions FollowShapes();
  void OnFact(const Fact& fact);
  void NoteOutcome(const Fact& fact);
  void GuideAnew(int64_t submap_id);
  void StartIfDue();
  void Start(int64_t submap_id);
  PlaceInput InputOf(const ShapePtr& shape) const;
  void OnDone(int64_t submap_id, const Job& job);
  void NoteFailure(int64_t submap_id, const Status& status);
  void Tell(const PlaceGuidance& guidance);
  void TellAgain();

  Node& node_;
  const GuideOptions options_;
  const NoGoAreas no_go_;
  SessionState state_;
  ShapeStore store_;
  std::deque<int64_t> changed_;  // submaps with a new shape, the longest waiting first
  bool working_ = false;
  bool waiting_ = false;  // for the time that work is due
  VainAdvice vain_;
  WorkShare share_;
  double noted_cpu_s_ = 0;  // of this process, as share_ knows it
  int64_t num_done_ = 0;
  double sum_s_ = 0;
  // By submap; used by the worker.
  std::map<int64_t, std::shared_ptr<PlaceGuide>> guides_;
  FailedItems failed_;                      // submaps
  std::map<int64_t, guidance_t> guidance_;  // as told, by submap
  std::map<std::string, advice_t> advice_;  // as told, by agent
  PollLoop::TimerId timer_ = 0;
  std::unique_ptr<LedgerFollower> follower_;
  std::unique_ptr<ShapeFollower> shapes_;
  Alive alive_;
  std::unique_ptr<WorkerThread> worker_;  // last: ends first
};

}  // namespace skein
