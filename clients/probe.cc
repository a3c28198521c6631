#include "clients/probe.h"

#include <unistd.h>

#include <exception>
#include <iostream>
#include <memory>
#include <string>

#include "clients/subcommand.h"
#include "event_loop/poll_loop.h"
#include "transport/link.h"

namespace skein {
namespace {

// Sends repeatedly: the first message may come before a relay is there or knows the subscription.
// Throws std::runtime_error if nothing can be sent at all.
bool CarriesMessages(const LcmUrl& url, double timeout_s) {
  constexpr double kPeriodS = 0.1;
  const std::string channel = "SKEIN_PROBE_" + std::to_string(getpid());
  PollLoop loop;
  bool received = false;
  const std::unique_ptr<Link> link =
      MakeLink(url, loop, [&](const std::string&, const Bytes&) { received = true; });
  link->Subscribe(channel);
  const auto send = [&] { link->Publish(channel, channel.data(), channel.size()); };
  send();
  const PollLoop::TimerId timer = loop.AddTimer(kPeriodS, send);
  loop.RunUntil([&] { return received; }, timeout_s);
  loop.CancelTimer(timer);
  return received;
}

bool Passes(const std::string& url, double timeout_s) {
  try {
    return CarriesMessages(ParseLcmUrl(url), timeout_s);
  } catch (const std::exception& problem) {
    std::cerr << problem.what() << std::endl;
    return false;
  }
}

}  // namespace

int RunProbe(int argc, char** argv) {
  std::string url;
  double timeout_s = 3;
  CLI::App app("Tells whether messages pass on an LCM URL from this host to itself.",
               "skein probe");
  app.add_option("--lcm-url", url, "udpm://... or tcpq://...")->required();
  app.add_option("--timeout", timeout_s, "seconds to try")->capture_default_str();
  if (const auto exit_code = ParseOptions(&app, argc, argv)) return *exit_code;

  const bool passes = Passes(url, timeout_s);
  std::cout << url << (passes ? " carries messages" : " carries no messages on this host")
            << std::endl;
  return passes ? kExitOk : kExitError;
}

}  // namespace skein
