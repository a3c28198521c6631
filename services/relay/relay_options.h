#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "config/program_options.h"
#include "core/result.h"
#include "node/node.h"

namespace skein {

struct RelayProgramOptions {
  RelayProgramOptions() { node.service = node.instance = "relay"; }

  std::vector<int> ports = {7700, 7701};  // a relay each
  size_t max_queue_mib = 8;               // waiting for one client before it loses messages
  int max_clients = 512;                  // connections a port
  bool loopback = false;                  // not reached from other hosts
  std::optional<int> watch_port;          // of the first port, in the clear, for listening alone
  // Session folder, URL, auth, instance and verbose. Without a session it forwards everything; with
  // a tcpqs URL the ports speak TLS.
  NodeOptions node;

  Status Check() const;
};

// Command line, and [relay] of a config file.
Program RelayProgram(RelayProgramOptions* options);

}  // namespace skein
