#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "config/program_options.h"
#include "core/result.h"

namespace skein {

struct RelayProgramOptions {
  std::vector<int> ports = {7700, 7701};  // a relay each
  size_t max_queue_mib = 8;               // waiting for one client before it loses messages
  int max_clients = 512;                  // connections a port
  bool loopback = false;                  // not reached from other hosts
  std::optional<int> watch_port;          // of the first port, in the clear, for listening alone
  std::string session_dir;                // "": it knows no session and forwards everything
  std::string lcm_url;                    // of the session: with tcpqs the ports speak TLS
  std::string auth;                       // off, warn, require; "": by the URL
  std::string instance = "relay";         // in heartbeats
  bool verbose = false;

  Status Check() const;
};

// Command line, and [relay] of a config file.
Program RelayProgram(RelayProgramOptions* options);

}  // namespace skein
