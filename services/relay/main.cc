#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>
#include <vector>

#include "core/log.h"
#include "event_loop/poll_loop.h"
#include "node/node.h"
#include "relay/relay.h"

int main(int argc, char** argv) {
  std::vector<int> ports = {7700, 7701};
  size_t max_queue_mib = 8;
  bool verbose = false;
  CLI::App app("Relay for tcpq:// URLs. Skein needs one on PORT and, for bulk data, on PORT + 1.");
  app.add_option("port,--port", ports, "TCP ports, each a network of its own")
      ->check(CLI::Range(1, 65535))
      ->capture_default_str();
  app.add_option("--max-queue-mib", max_queue_mib,
                 "Waiting for one client before it loses messages")
      ->check(CLI::Range(1, 1024))
      ->capture_default_str();
  app.add_flag("--verbose", verbose, "Log who comes and goes");
  if (const auto code = skein::ParseCommandLine(app, argc, argv)) return *code;
  try {
    skein::InitLog("relay", verbose);
    skein::PollLoop loop;
    loop.StopOnSignals();
    std::vector<std::unique_ptr<skein::Relay>> relays;
    for (const int port : ports) {
      const skein::RelayOptions options{port, max_queue_mib << 20};
      relays.push_back(std::make_unique<skein::Relay>(loop, options));
    }
    std::printf("ready relay\n");
    std::fflush(stdout);
    loop.Run();
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "skein-relay: %s\n", error.what());
    return 1;
  }
}
