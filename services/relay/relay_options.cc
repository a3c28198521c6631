#include "relay/relay_options.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <string>

#include "core/option_check.h"
#include "transport/lcm_url.h"

namespace skein {
namespace {

// A client's messages on a port for bulk data: Gigabit Ethernet carries so many chunks of 24 KiB.
constexpr double kMaxBulkMessagesPerS = 5000;

// By the session's URL: scripts/launch.sh starts a process for each of its ports. Without a session
// no rate is held.
bool CarriesBulk(const std::string& session_url, int port) {
  return !session_url.empty() && port == ParseLcmUrl(session_url).Bulk().port;
}

}  // namespace

Status RelayProgramOptions::Check() const {
  for (const int port : ports) {
    if (const Status status = InRange("port", port, 1, 65535); !status.ok()) return status;
  }
  if (relay.watch_port) {
    const Status status = InRange("watch_port", *relay.watch_port, 1, 65535);
    if (!status.ok()) return status;
  }
  if (node.session_dir.empty() != node.lcm_url.empty()) {
    return InvalidArgument("--session and --lcm-url go together: the session's folder and its URL");
  }
  return InRange("max_clients", relay.max_clients, 4, 10'000);
}

RelayOptions RelayProgramOptions::OfPort(int port, int max_clients) const {
  RelayOptions of_port = relay;
  of_port.port = port;
  of_port.max_clients = std::min(relay.max_clients, max_clients / static_cast<int>(ports.size()));
  if (CarriesBulk(node.lcm_url, port)) of_port.max_messages_per_s = kMaxBulkMessagesPerS;
  if (port != ports.front()) of_port.watch_port.reset();
  return of_port;
}

Program RelayProgram(RelayProgramOptions* options) {
  Program program;
  program.section = "relay";
  program.description =
      "Relay for tcpq:// and tcpqs:// URLs. Skein needs one on PORT and, for bulk data, on PORT + "
      "1.";
  program.add_place_options = [options](CLI::App& app) {
    app.add_option("port,--port", options->ports, "TCP ports, each a network of its own")
        ->capture_default_str();
    app.add_flag("--loopback", options->relay.loopback, "Listen to this host alone");
    app.add_option("--session", options->node.session_dir,
                   "Folder of the session that it serves: it then forwards what the session's keys "
                   "permit, and tells how it is");
    app.add_option("--lcm-url", options->node.lcm_url,
                   "The session's URL; with tcpqs://HOST:PORT the ports speak TLS");
    app.add_option("--auth", options->node.auth,
                   "Messages without a signature: off (no signature is looked at), warn (only what "
                   "anybody may say) or require (none); default: require where the URL leaves this "
                   "host, else warn")
        ->check(CLI::IsMember({"off", "warn", "require"}));
    app.add_option("--watch-port", options->relay.watch_port,
                   "A further port for lcm-spy and lcm-logger on this host: in the clear, with all "
                   "messages of the first port; what is published there is dropped");
    app.add_option("--instance", options->node.instance, "Its name in the session")
        ->capture_default_str();
    app.add_flag("--verbose", options->node.verbose, "Log who comes and goes");
  };
  program.add_options = [options](CLI::App& app) {
    app.add_option("--max-clients", options->relay.max_clients,
                   "Connections a port, half of them from one address at most");
  };
  program.check = [options] { return options->Check(); };
  return program;
}

}  // namespace skein
