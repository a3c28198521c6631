#include "clients/client_node.h"

#include <CLI/CLI.hpp>
#include <stdexcept>

#include "core/log.h"
#include "ledger/session_folder.h"

namespace skein {

void AddClientOptions(CLI::App& app, ClientOptions* options) {
  auto* dir = app.add_option("--session", options->session_dir, "Session folder, on its host");
  app.add_option("--session-id", options->session_id,
                 "Elsewhere: the session's id; default: the first session heard")
      ->excludes(dir);
  app.add_option("--lcm-url", options->lcm_url,
                 "LCM's URL: udpm://239.255.76.67:7667?ttl=0 or tcpq://HOST:7700; else "
                 "LCM_DEFAULT_URL");
  app.add_flag("--verbose", options->verbose, "Log more");
}

std::unique_ptr<Node> MakeClientNode(const std::string& service, const std::string& instance,
                                     const ClientOptions& options) {
  InitLog(service, options.verbose);
  NodeOptions node;
  node.service = service;
  node.instance = instance;
  node.lcm_url = options.lcm_url;
  node.session_id = options.session_id.empty() ? "auto" : options.session_id;
  if (!options.session_dir.empty()) {
    const Result<Session> session = OpenSession(options.session_dir);
    if (!session.ok()) throw std::runtime_error(session.error());
    node.session_id = session->session_id;
  }
  return std::make_unique<Node>(node);
}

}  // namespace skein
