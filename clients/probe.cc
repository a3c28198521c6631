#include "clients/probe.h"

#include <unistd.h>

#include <exception>
#include <iostream>
#include <memory>
#include <stdexcept>
#include <string>

#include "auth/relay_certificate.h"
#include "clients/subcommand.h"
#include "event_loop/poll_loop.h"
#include "ledger/session_folder.h"
#include "transport/link.h"

namespace skein {
namespace {

// Sends repeatedly: the first message may come before a relay is there or knows the subscription.
// Throws std::runtime_error if nothing can be sent at all.
bool CarriesMessages(const LcmUrl& url, double timeout_s) {
  constexpr double kPeriodS = 0.1;
  const std::string channel = "PROBE_" + std::to_string(getpid());
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

LcmUrl UrlOf(const std::string& text, const std::string& session_dir) {
  LcmUrl url = ParseLcmUrl(text);
  if (url.provider != "tcpqs" || !url.pin.empty() || session_dir.empty()) return url;
  const Result<std::string> pin = ReadRelayPin(SessionPaths{session_dir}.Keys().string());
  if (!pin.ok()) throw std::runtime_error(pin.error());
  url.pin = *pin;
  return url;
}

bool Passes(const LcmUrl& url, double timeout_s) {
  try {
    return CarriesMessages(url, timeout_s);
  } catch (const std::exception& problem) {
    std::cerr << "skein probe: " << problem.what() << std::endl;
    return false;
  }
}

}  // namespace

int RunProbe(int argc, char** argv) {
  std::string url, session_dir;
  double timeout_s = 3;
  CLI::App app("Tells whether messages pass on an LCM URL from this host to itself.",
               "skein probe");
  app.add_option("--lcm-url", url, "udpm://..., tcpq://... or tcpqs://...")->required();
  app.add_option("--session", session_dir,
                 "Session folder, for the fingerprint of its relay; else tcpqs://...?pin=...");
  app.add_option("--timeout", timeout_s, "seconds to try")->capture_default_str();
  if (const auto exit_code = ParseOptions(&app, argc, argv)) return *exit_code;

  LcmUrl parsed;
  try {
    parsed = UrlOf(url, session_dir);
  } catch (const std::invalid_argument& error) {
    std::cerr << "skein probe: " << error.what() << std::endl;
    return kExitUsage;
  }
  const bool passes = Passes(parsed, timeout_s);
  std::cout << url << (passes ? " carries messages" : " carries no messages on this host");
  // The probe is not signed.
  if (!passes && parsed.goes_over_relay()) {
    std::cout << ", or its relay takes signed messages alone (--auth require)";
  }
  std::cout << std::endl;
  return passes ? kExitOk : kExitError;
}

}  // namespace skein
