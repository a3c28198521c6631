// Demand: work that no worker is free for. Its owner publishes it; pools of workers listen, and
// mappers, which may share.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "node/node.h"

namespace skein {

// Tells how much work of one kind waits: every second, and at once when that changes. Loop's thread
// only.
class DemandTeller {
 public:
  DemandTeller(Node& node, std::string kind);
  ~DemandTeller();
  DemandTeller(const DemandTeller&) = delete;
  DemandTeller& operator=(const DemandTeller&) = delete;

  void Set(int num_waiting);

 private:
  void Tell();

  Node& node_;
  const std::string kind_;
  int num_waiting_ = 0;
  PollLoop::TimerId timer_ = 0;
};

// The waiting work and the workers of one kind, by recent messages. `now_s` is any monotonic time.
// A process that is silent for `forget_s` is forgotten with its messages.
class DemandBook {
 public:
  explicit DemandBook(std::string kind, double forget_s = 3.5)
      : kind_(std::move(kind)), forget_s_(forget_s) {}

  void OnDemand(const demand_t& demand, double now_s);
  void OnRequest(const work_request_t& request, double now_s);

  // Items that wait.
  int NumWaiting(double now_s) const { return Sum(demands_, now_s); }
  // Items that wait beyond what the idle workers can take: so many workers are missing.
  int NumShort(double now_s) const;
  // Workers heard, by name.
  std::vector<std::string> Workers(double now_s) const;

 private:
  struct Heard {
    int number = 0;  // waiting items, or capacity of a worker
    double heard_s = 0;
  };
  using HeardBy = std::map<std::string, Heard>;

  int Sum(const HeardBy& heard, double now_s) const;

  const std::string kind_;
  const double forget_s_;
  HeardBy demands_;
  HeardBy workers_;
};

}  // namespace skein
