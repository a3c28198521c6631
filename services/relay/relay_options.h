#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "core/result.h"

namespace skein {

struct RelayProgramOptions {
  std::vector<int> ports = {7700, 7701};  // a relay each
  size_t max_queue_mib = 8;               // waiting for one client before it loses messages
  int max_clients = 512;                  // connections a port
  bool loopback = false;                  // not reached from other hosts
  bool verbose = false;

  Status Check() const;
};

// Command line, and [relay] of a config file. The exit code, if the program is to end now.
std::optional<int> ParseRelayOptions(int argc, char** argv, RelayProgramOptions* options);

}  // namespace skein
