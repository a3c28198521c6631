#include <sys/resource.h>

#include <algorithm>
#include <cstdio>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "config/program_options.h"
#include "core/log.h"
#include "core/version.h"
#include "event_loop/poll_loop.h"
#include "event_loop/sign_of_life.h"
#include "relay/relay.h"
#include "relay/relay_options.h"
#include "relay/relay_session.h"

namespace {

constexpr int kOwnDescriptors = 64;  // files, pipes, listeners

// Descriptors for clients. Raises the limit to what the system permits.
int MaxClients() {
  rlimit limit{};
  ::getrlimit(RLIMIT_NOFILE, &limit);
  limit.rlim_cur = std::min<rlim_t>(limit.rlim_max, 1 << 16);
  ::setrlimit(RLIMIT_NOFILE, &limit);
  ::getrlimit(RLIMIT_NOFILE, &limit);
  return std::max(4, static_cast<int>(limit.rlim_cur) - kOwnDescriptors);
}

// Runs until a signal.
void Run(const skein::RelayProgramOptions& options) {
  skein::PollLoop loop;
  loop.StopOnSignals();
  const skein::SignOfLife sign_of_life(loop);
  std::optional<skein::RelaySession> session;
  if (!options.node.session_dir.empty()) session.emplace(options.node);
  std::vector<std::unique_ptr<skein::Relay>> relays;
  for (const int port : options.ports) {
    skein::RelayOptions of_port = options.OfPort(port, MaxClients());
    if (session) {
      of_port.tls = session->Tls();
      of_port.members_only = session->is_closed();
    }
    relays.push_back(
        std::make_unique<skein::Relay>(loop, of_port, session ? session->MakeGuard() : nullptr));
  }
  if (session) session->Speak(loop, relays);
  std::printf("ready relay\n");
  std::fflush(stdout);
  loop.Run();
}

}  // namespace

int main(int argc, char** argv) {
  skein::RelayProgramOptions options;
  skein::Program program = skein::RelayProgram(&options);
  program.version = skein::VersionWithCommit();
  std::string configuration;  // the relay belongs to no session that would note it
  if (const auto code = skein::ParseProgramOptions(program, argc, argv, &configuration)) {
    return *code;
  }
  try {
    skein::InitLog(options.node.instance, options.node.verbose);
    Run(options);
    return 0;
  } catch (const std::invalid_argument& error) {
    std::fprintf(stderr, "skein-relay: %s\n", error.what());
    return 2;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "skein-relay: %s\n", error.what());
    return 1;
  }
}
