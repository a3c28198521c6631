// The ledger as a sequence: every fact once, in order, whatever gets lost.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <vector>

#include "ledger/facts.h"
#include "node/node.h"
#include "transport/bus.h"

namespace skein {

// Listens to the committed facts. Missing facts (lost, or older than this process) are pulled from
// ingest as blobs of a range, one at a time. So a late joiner reads at its own pace. Ingest repeats
// the ledger's head, which reveals a lost last fact. An exception of on_fact, or of an observer of
// the node, is noted by the loop (PollLoop::RunNoting), and the next fact is delivered: what this
// process does about the fact is left out. The fact changes the process's state whole: a fold like
// SessionState turns its own exceptions into BrokenState, which ends the process. Loop's thread
// only.
class LedgerFollower {
 public:
  using OnFact = std::function<void(const Fact&)>;

  // Calls on_fact for the facts from_seq, from_seq + 1, ... from_seq >= 1: 1 to replay all, the
  // seq after a checkpoint's to go on from there.
  LedgerFollower(Node& node, int64_t from_seq, OnFact on_fact);
  ~LedgerFollower();
  LedgerFollower(const LedgerFollower&) = delete;
  LedgerFollower& operator=(const LedgerFollower&) = delete;

  // The last fact given to on_fact; while on_fact runs, that fact's.
  int64_t processed_seq() const { return next_seq_ - 1; }
  // The last fact known to be committed; 0 before anything was heard.
  int64_t head_seq() const { return head_seq_; }
  // Everything known of is processed, and something was heard of ingest.
  bool caught_up() const { return heard_ && processed_seq() >= head_seq_; }

 private:
  void OnCommitted(Fact fact);
  void OnHead(const ledger_head_t& head);
  void OnRange(const ledger_range_t& range);
  void OnRangeBytes(const Result<Bytes>& bytes);
  void DeliverReady();
  void Repair();
  // Asking up to here closes all gaps at once. Some facts then come twice.
  int64_t LastMissing() const;

  Node& node_;
  const OnFact on_fact_;
  int64_t next_seq_;
  int64_t head_seq_ = 0;
  bool heard_ = false;
  bool delivering_ = false;
  std::map<int64_t, Fact> ahead_;  // facts beyond a gap

  double gap_since_s_ = 0;  // 0: no gap
  double ask_due_s_ = 0;
  double ask_interval_s_;
  BlobClient::FetchId fetch_ = 0;  // 0: none under way
  std::vector<Bus::SubscriptionId> subscriptions_;
  PollLoop::TimerId timer_ = 0;
};

}  // namespace skein
