// Hands facts to ingest until it has them.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "blobs/blob_client.h"
#include "event_loop/poll_loop.h"
#include "ledger/facts.h"
#include "transport/bus.h"

namespace skein {

// Outcome of a submission.
struct Submission {
  enum class State {
    kCommitted,  // in the ledger at `seq`, by this submission or another of its fact_id
    kRefused,    // for `reason`: ingest cannot take it as things stand
    kNotLeased,  // refused because its submap has ended or is another's by now: see `reason`
  };
  State state = State::kRefused;
  int64_t seq = 0;
  std::string reason;

  bool committed() const { return state == State::kCommitted; }
};

// Loop's thread only.
class Submitter {
 public:
  using OnDone = std::function<void(const Submission&)>;

  Submitter(PollLoop& loop, Bus& bus, BlobClient& blobs, std::string session_id,
            std::string instance);
  ~Submitter();
  Submitter(const Submitter&) = delete;
  Submitter& operator=(const Submitter&) = delete;

  // Repeats the submission until ingest commits or refuses it, or the fact is seen in the ledger:
  // after 0.2 s at first, at last every 2 s. Then releases the fact's blobs and calls on_done,
  // once. Fills session_id and author. Throws std::invalid_argument without header.fact_id. A
  // pending fact_id is submitted once, with the first content; both functions are called.
  void Submit(Fact fact, OnDone on_done);

  // Facts not yet answered for.
  int pending() const { return static_cast<int>(pending_.size()); }

  // A committed fact was seen; Node calls this.
  void OnCommitted(const fact_header_t& header);

 private:
  struct Pending {
    Fact fact;
    std::vector<OnDone> on_done;
    double interval_s;
    double due_s;
  };

  void OnReply(const submit_reply_t& reply);
  void Send(Pending* pending);
  void SendDue();
  void Finish(const std::string& fact_id, const Submission& submission);

  PollLoop& loop_;
  Bus& bus_;
  BlobClient& blobs_;
  const std::string session_id_;
  const std::string instance_;
  std::map<std::string, Pending> pending_;  // by fact_id
  Bus::SubscriptionId reply_subscription_ = 0;
  PollLoop::TimerId timer_ = 0;
};

}  // namespace skein
