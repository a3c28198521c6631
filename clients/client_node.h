// A node for a command: it knows its session, and shares nothing of the folder.
#pragma once

#include <memory>
#include <string>

#include "ledger/session_folder.h"
#include "node/node.h"

namespace CLI {
class App;
}

namespace skein {

struct ClientOptions {
  std::string session_dir;  // --session: read for the session's id, keys and URL only
  NodeOptions node;         // --session-id, --invite, --lcm-url, --auth, --verbose
};

// --session, --session-id, --invite, --lcm-url, --auth, --verbose.
void AddClientOptions(CLI::App& app, ClientOptions* options);

// A command that signs as `role`. Its instance is `service`, a dot and the process's number.
// Throws std::runtime_error, with a line for the user, without a session, credential or bus, and
// where the folder leads to another host (clients/launched.h).
std::unique_ptr<Node> MakeClientNode(const std::string& service, Role role,
                                     const ClientOptions& options);

// An agent, under the name of the invitation where it has none. `name` is set then.
std::unique_ptr<Node> MakeAgentNode(const ClientOptions& options, std::string* name);

}  // namespace skein
