#include <cstdio>
#include <memory>
#include <vector>

#include "core/log.h"
#include "event_loop/poll_loop.h"
#include "event_loop/sign_of_life.h"
#include "relay/relay.h"
#include "relay/relay_options.h"

int main(int argc, char** argv) {
  skein::RelayProgramOptions options;
  if (const auto code = skein::ParseRelayOptions(argc, argv, &options)) return *code;
  try {
    skein::InitLog("relay", options.verbose);
    skein::PollLoop loop;
    loop.StopOnSignals();
    const skein::SignOfLife sign_of_life(loop);
    std::vector<std::unique_ptr<skein::Relay>> relays;
    for (const int port : options.ports) {
      const skein::RelayOptions of_port{port, options.max_queue_mib << 20, options.loopback};
      relays.push_back(std::make_unique<skein::Relay>(loop, of_port));
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
