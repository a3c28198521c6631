// Processes of a session as their heartbeats tell them.
#pragma once

#include "node/node.h"
#include "session/heard_processes.h"

namespace skein {

// Listens from its construction on; its own node is none of them. Loop's thread only; the node
// outlives it.
class ProcessWatch {
 public:
  explicit ProcessWatch(Node& node);
  ~ProcessWatch();
  ProcessWatch(const ProcessWatch&) = delete;
  ProcessWatch& operator=(const ProcessWatch&) = delete;

  // Without those that said that they end.
  const HeardProcesses& processes() const { return processes_; }
  double listened_s() const { return node_.loop().now_s() - since_s_; }

 private:
  void OnHeartbeat(const heartbeat_t& heartbeat);

  Node& node_;
  const double since_s_;
  HeardProcesses processes_;
  Bus::SubscriptionId subscription_;
};

}  // namespace skein
