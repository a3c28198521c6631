// A node for a command: it knows its session, and shares nothing of the folder.
#pragma once

#include <memory>
#include <string>

#include "node/node.h"

namespace CLI {
class App;
}

namespace skein {

struct ClientOptions {
  std::string session_dir;  // --session: read for the session's id only
  std::string session_id;   // --session-id; "auto": the first session heard
  std::string lcm_url;      // --lcm-url
  bool verbose = false;     // --verbose
};

// --session, --session-id, --lcm-url, --verbose.
void AddClientOptions(CLI::App& app, ClientOptions* options);

// Throws std::runtime_error, with a line for the user, without a session or bus.
std::unique_ptr<Node> MakeClientNode(const std::string& service, const std::string& instance,
                                     const ClientOptions& options);

}  // namespace skein
