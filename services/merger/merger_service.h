// The merger's handlers. The merger follows the ledger and the submaps' status. Decisions on seeds,
// merges and the end of a finish are made one at a time. The merger keeps nothing that the ledger
// does not hold.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "event_loop/worker_thread.h"
#include "geometry/sim3_ransac.h"
#include "merger/merge_policy.h"
#include "merger/merger_options.h"
#include "merger/seed_policy.h"
#include "merger/submap_directory.h"
#include "node/demand.h"
#include "node/ledger_follower.h"
#include "node/node.h"

namespace skein {

class MergerService {
 public:
  MergerService(Node& node, const MergerOptions& options);
  ~MergerService();

 private:
  // Similarity of one pair, on its way: request, two replies, two blobs, estimation.
  struct Estimate {
    MergeAttempt attempt;
    int64_t request_id = 0;
    double started_s = 0;
    double asked_s = 0;
    std::map<int64_t, Result<Bytes>> blobs;   // by submap
    std::map<int64_t, std::string> fetching;  // submap -> blob being fetched
    bool computing = false;
  };

  void OnFact(const Fact& fact);
  void React(const image_t&) { NoteActivity(); }
  void React(const matches_t&) { NoteActivity(); }
  void React(const registration_t& registration);
  void React(const submap_lease_t& lease);
  void React(const merge_t& merge);
  void React(const finish_t& finish);
  template <class T>
  void React(const T&) {}

  void OnStatus(const submap_status_t& status);
  void OnHead(const ledger_head_t& head);
  void OnWorkRequest(const work_request_t& request);
  void OnSharedReply(const shared_reply_t& reply);
  void OnSharedBlob(int64_t submap_id, int64_t request_id, Result<Bytes> blob);

  void NoteActivity();
  void Decide();
  bool MayDecide() const;
  bool IsFinishing() const { return session_.finish().state == finish_t::DRAINED; }
  bool TrySeed();
  void WantMapper(bool wanted);
  void TryMerge();
  bool TryBatch();
  void TrySettle();
  void SubmitFinish(int8_t state);
  bool EverySubmapWorkedUpTo(int64_t seq) const;
  int NumIdleMappers() const;

  void AskForShared();
  bool EstimateIsStale() const;
  void ComputeEstimate();
  void OnEstimated(MergeAttempt attempt, const Sim3Options& options, Sim3Result result,
                   double duration_s);
  int64_t EvidenceUtimeOf(const MergeAttempt& attempt) const;
  void Submit(Fact fact, std::function<void(bool committed)> then);

  Node& node_;
  const MergerOptions options_;
  DemandTeller mappers_wanted_;
  SessionState session_;
  SubmapDirectory directory_{session_};
  SeedPolicy seeds_;
  MergePolicy merges_;
  MergeEvidence evidence_;

  int64_t settle_seq_ = 0;     // submaps must have worked up to here before the session settles
  int64_t await_seq_ = 0;      // our own latest fact: decide when it was applied
  double hold_until_s_ = 0;    // after a refusal
  double active_s_ = 0;        // when something last happened to a photo
  double wants_mapper_s_ = 0;  // since when a seed waits for a mapper, 0: none does
  std::map<int64_t, SubmapDirectory::Position>
      new_statuses_;  // heard, not yet known to be covered by the ledger read
  std::map<int64_t, SubmapDirectory::Position> heard_statuses_;  // heard before the latest head
  std::map<std::string, double> idle_mappers_;                   // instance -> when it last asked
  std::unique_ptr<Estimate> estimate_;
  int64_t next_request_id_;
  int64_t num_merged_ = 0;

  WorkerThread worker_;
  std::unique_ptr<LedgerFollower> follower_;
  std::vector<Bus::SubscriptionId> subscriptions_;
  PollLoop::TimerId timer_ = 0;
};

}  // namespace skein
