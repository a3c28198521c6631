// Publishes rendered photos as their agents would: one `skein agent` process each.
#pragma once

#include <sys/types.h>

#include <string>
#include <vector>

#include "clients/sim/sim.h"

namespace skein::sim {

struct PublishOptions {
  std::vector<std::string> session;  // of `skein agent`: --session, --session-id, --lcm-url, --rate
  bool one_after_the_other = false;  // else all at once
};

// Runs `program` agent --name NAME --images FOLDER for every agent and waits. Returns the largest
// exit code (1 for an agent that a signal ended). Throws when a process cannot be started.
int PublishSession(const std::string& program, const std::vector<RenderedAgent>& agents,
                   const PublishOptions& options);

// Runs `skein agent --watch` for each agent: photos that appear in the folder are published. The
// destructor stops the processes.
class WatchingAgents {
 public:
  WatchingAgents(const std::string& program, const std::vector<RenderedAgent>& agents,
                 const PublishOptions& options);
  ~WatchingAgents();
  WatchingAgents(const WatchingAgents&) = delete;
  WatchingAgents& operator=(const WatchingAgents&) = delete;

 private:
  std::vector<pid_t> running_;
};

}  // namespace skein::sim
