// The sender of the ledger, for ingest: broadcasts committed facts, repeats the head, answers
// requests for ranges.
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <optional>

#include "core/bytes.h"
#include "ledger/facts.h"
#include "node/node.h"
#include "transport/bus.h"

namespace skein {

// Equal requests get the same blob, and large requests get it in parts that begin at fixed places:
// many who read the ledger at once cost little memory. Loop's thread only.
class LedgerServer {
 public:
  // Calls `visit(kind, payload)` for the committed facts from_seq..to_seq in order, while visit
  // returns true. Payload as by EncodeFact.
  using Visit = std::function<bool(int kind, const Bytes& payload)>;
  using ReadRange = std::function<void(int64_t from_seq, int64_t to_seq, const Visit& visit)>;

  LedgerServer(Node& node, int64_t head_seq, ReadRange read_range);
  ~LedgerServer();
  LedgerServer(const LedgerServer&) = delete;
  LedgerServer& operator=(const LedgerServer&) = delete;

  // The fact is durable: tells everyone. Facts come in order of seq.
  void Broadcast(const Fact& fact);
  // Photos not yet through matching. While there are any, and during a finish, whose steps wait for
  // it, the head goes out at 10 Hz, else at 1 Hz.
  void SetActivity(int num_in_flight, bool finishing) {
    in_flight_ = num_in_flight;
    finishing_ = finishing;
  }
  int64_t head_seq() const { return head_seq_; }

 private:
  void Tick();
  void SendHead();
  void OnRequest(const ledger_request_t& request);
  std::optional<ledger_range_t> MakeRange(int64_t from_seq, int64_t to_seq);
  std::optional<ledger_range_t> FindOrMakeRange(int64_t from_seq, int64_t to_seq);

  struct Made {
    int64_t asked_to_seq;  // the range may end earlier
    ledger_range_t range;
  };

  Node& node_;
  const ReadRange read_range_;
  int64_t head_seq_;
  int in_flight_ = 0;
  bool finishing_ = false;
  double sent_s_ = 0;
  std::deque<Made> made_;  // latest last
  Bus::SubscriptionId subscription_ = 0;
  PollLoop::TimerId timer_ = 0;
};

}  // namespace skein
