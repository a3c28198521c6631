#include "clients/client_node.h"

#include <unistd.h>

#include <CLI/CLI.hpp>
#include <stdexcept>

#include "clients/launched.h"
#include "core/log.h"

namespace skein {
namespace {

// Where the session is, and whom the command signs as.
NodeOptions NodeOf(const ClientOptions& options, const std::string& service, Role role) {
  InitLog(service, options.node.verbose);
  NodeOptions node = options.node;
  node.service = service;
  node.signer.role = role;
  if (!options.session_dir.empty()) {
    const Result<Session> session = OpenSession(options.session_dir);
    if (!session.ok()) throw std::runtime_error(session.error());
    node.session_id = session->session_id;
    node.signer.keys_dir = session->paths.Keys().string();
    if (node.lcm_url.empty()) {
      const Result<std::string> url = LaunchedUrl(session->paths);
      if (!url.ok()) throw std::runtime_error(url.error());
      node.lcm_url = *url;
    }
  } else if (node.invite.empty() && node.session_id.empty()) {
    node.session_id = "auto";
  }
  return node;
}

}  // namespace

void AddClientOptions(CLI::App& app, ClientOptions* options) {
  app.add_option("--session", options->session_dir, "Session folder, on its host");
  AddPlaceOptions(app, &options->node);
  app.get_option("--session-id")->excludes("--session");
  app.get_option("--lcm-url")
      ->description(
          "LCM's URL: udpm://239.255.76.67:7667?ttl=0, tcpq://HOST:7700, or tcpqs://HOST:7700 "
          "(encrypted); else that of `skein launch` on the session folder, the invitation's, or "
          "LCM_DEFAULT_URL");
  app.add_flag("--verbose", options->node.verbose, "Log more");
}

std::unique_ptr<Node> MakeClientNode(const std::string& service, Role role,
                                     const ClientOptions& options) {
  NodeOptions node = NodeOf(options, service, role);
  if (node.instance.empty()) node.instance = service + "." + std::to_string(getpid());
  return std::make_unique<Node>(node);
}

std::unique_ptr<Node> MakeAgentNode(const ClientOptions& options, std::string* name) {
  NodeOptions node = NodeOf(options, "agent", Role::kAgent);
  if (!node.invite.empty()) {
    const Result<Invitation> invitation = ReadInvitation(node.invite);
    if (!invitation.ok()) throw std::runtime_error("--invite: " + invitation.error());
    const std::string& invited = invitation->credential.certificate.name;
    if (name->empty()) *name = invited;
    if (*name != invited) {
      throw std::runtime_error("the invitation is for --name " + invited + ", not " + *name);
    }
  }
  if (name->empty()) throw std::runtime_error("give --name NAME");
  node.instance = AgentInstance(*name);
  node.signer.certified_name = *name;
  return std::make_unique<Node>(node);
}

}  // namespace skein
