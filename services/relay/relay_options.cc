#include "relay/relay_options.h"

#include <CLI/CLI.hpp>
#include <string>

#include "config/program_options.h"
#include "core/option_check.h"

namespace skein {

Status RelayProgramOptions::Check() const {
  for (const int port : ports) {
    if (const Status status = InRange("port", port, 1, 65535); !status.ok()) return status;
  }
  return FirstError({InRange<size_t>("max_queue_mib", max_queue_mib, 1, 1024),
                     InRange("max_clients", max_clients, 4, 10'000)});
}

std::optional<int> ParseRelayOptions(int argc, char** argv, RelayProgramOptions* options) {
  Program program;
  program.section = "relay";
  program.description =
      "Relay for tcpq:// URLs. Skein needs one on PORT and, for bulk data, on PORT + 1.";
  program.add_place_options = [options](CLI::App& app) {
    app.add_option("port,--port", options->ports, "TCP ports, each a network of its own")
        ->capture_default_str();
    app.add_flag("--loopback", options->loopback, "Listen to this host alone");
    app.add_flag("--verbose", options->verbose, "Log who comes and goes");
  };
  program.add_options = [options](CLI::App& app) {
    app.add_option("--max-queue-mib", options->max_queue_mib,
                   "Waiting for one client before it loses messages, MiB");
    app.add_option("--max-clients", options->max_clients,
                   "Connections a port, half of them from one address at most");
  };
  program.check = [options] { return options->Check(); };
  std::string configuration;  // the relay belongs to no session that would note it
  return ParseProgramOptions(program, argc, argv, &configuration);
}

}  // namespace skein
