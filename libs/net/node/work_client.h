// Asks ingest for work of one kind and keeps its leases.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "node/node.h"
#include "transport/bus.h"

namespace skein {

// Requests go out once a second, and at once when capacity frees. Each names the held items, which
// renews their leases. Destruction gives the held items back, so that another worker has them at
// once. If an exception is what ends the client, the current item fails before: given back as good,
// the item would end the next process. If a signal stopped the loop, this process then ends within
// kLeaveS, whatever its threads do: results that count are in the ledger. Loop's thread only.
class WorkClient {
 public:
  using OnWork = std::function<void(const work_t&)>;
  static constexpr double kLeaveS = 4;

  // kind: features, matching or submap. capacity: items held at a time. on_work is called once an
  // item, and again when a held item comes with a higher epoch.
  WorkClient(Node& node, std::string kind, int capacity, OnWork on_work);
  ~WorkClient();
  WorkClient(const WorkClient&) = delete;
  WorkClient& operator=(const WorkClient&) = delete;

  // The item's result is committed, or the item belongs to another worker now. No effect if the
  // item is not held.
  void Done(int64_t item_id);
  // The item cannot be done. Repeated until ingest's failure_t is seen, at most a minute: by then
  // the lease has lapsed. permanent: another try cannot help.
  void Fail(int64_t item_id, const std::string& reason, bool permanent);
  // A step of the work on a submap threw: it counts against the step (session/submap_steps.h).
  void FailStep(int64_t item_id, const std::string& step, const std::string& reason);
  // Names the held item that is being worked on, which is to blame if the process dies. Unset: the
  // one with the lowest id. Told at once.
  void SetCurrent(int64_t item_id);
  // At once effective; 0 takes nothing new.
  void SetCapacity(int capacity);

  int capacity() const { return capacity_; }
  int num_held() const { return static_cast<int>(held_.size()); }
  bool holds(int64_t item_id) const { return held_.count(item_id) > 0; }

 private:
  struct Failed {
    work_failed_t message;
    double due_s;
    double until_s;
  };

  void OnWorkMessage(const work_t& work);
  void OnFailure(const failure_t& failure);
  void Tell(work_failed_t message);
  void Tick();
  void Request();
  work_request_t MakeRequest() const;
  void FailCurrent();
  void GiveBack();
  std::vector<int64_t> HeldCurrentFirst() const;

  Node& node_;
  const std::string kind_;
  const std::string host_;
  const int previous_exit_signal_;
  const int num_exceptions_;  // under way when this was made
  int capacity_;
  const OnWork on_work_;
  std::map<int64_t, int64_t> held_;  // item -> epoch
  int64_t current_ = 0;
  std::map<int64_t, Failed> failed_;
  double request_due_s_ = 0;
  Bus::SubscriptionId work_subscription_ = 0;
  Bus::SubscriptionId failure_subscription_ = 0;
  int64_t observer_ = 0;
  PollLoop::TimerId timer_ = 0;
};

}  // namespace skein
