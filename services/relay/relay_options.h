#pragma once

#include <vector>

#include "config/program_options.h"
#include "core/result.h"
#include "node/node.h"
#include "relay/relay.h"

namespace skein {

struct RelayProgramOptions {
  RelayProgramOptions() { node.service = node.instance = "relay"; }

  std::vector<int> ports = {7700, 7701};  // a relay each
  // Options of each port. `port` is not set; watch_port holds for the first one.
  RelayOptions relay;
  // Session folder, URL, auth, instance and verbose. Without a session it forwards everything; with
  // a tcpqs URL the ports speak TLS.
  NodeOptions node;

  Status Check() const;
  // Options of `port`, one of `ports`. The ports share `max_clients`, for which the process has
  // descriptors. The session's port for bulk data, the one behind its URL's, has a higher rate.
  RelayOptions OfPort(int port, int max_clients) const;
};

// Command line, and [relay] of a config file.
Program RelayProgram(RelayProgramOptions* options);

}  // namespace skein
