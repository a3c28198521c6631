#include "clients/probe.h"

#include <unistd.h>

#include <iostream>
#include <lcm/lcm-cpp.hpp>
#include <string>

#include "clients/subcommand.h"
#include "core/clock.h"

namespace skein {
namespace {

struct Receiver {
  bool received = false;
  void Handle(const lcm::ReceiveBuffer*, const std::string&) { received = true; }
};

// Sends repeatedly: the first datagram may come before the relay knows the subscription.
bool CarriesMessages(lcm::LCM* bus, double timeout_s) {
  const std::string channel = "SKEIN_PROBE_" + std::to_string(getpid());
  Receiver receiver;
  if (bus->subscribe(channel, &Receiver::Handle, &receiver) == nullptr) return false;
  const double deadline_s = MonotonicS() + timeout_s;
  while (!receiver.received && MonotonicS() < deadline_s) {
    if (bus->publish(channel, channel.data(), channel.size()) != 0) return false;
    bus->handleTimeout(100);
  }
  return receiver.received;
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

  lcm::LCM bus(url);
  const bool passes = bus.good() && CarriesMessages(&bus, timeout_s);
  std::cout << url << (passes ? " carries messages" : " carries no messages on this host")
            << std::endl;
  return passes ? kExitOk : kExitError;
}

}  // namespace skein
