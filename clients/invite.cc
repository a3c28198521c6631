#include "clients/invite.h"

#include <unistd.h>

#include <CLI/CLI.hpp>
#include <charconv>
#include <iostream>
#include <stdexcept>
#include <string>
#include <vector>

#include "auth/relay_certificate.h"
#include "auth/session_keys.h"
#include "auth/web_certificate.h"
#include "auth/web_pass.h"
#include "clients/launched.h"
#include "clients/subcommand.h"
#include "core/clock.h"
#include "core/process.h"
#include "invite/browser_link.h"
#include "invite/qr_code.h"
#include "ledger/session_folder.h"
#include "transport/invitation.h"

namespace skein {
namespace {

struct InviteOptions {
  std::string session_dir;
  std::string role;
  std::string name;
  std::string expires;
  std::string lcm_url;
  std::string view;
  bool qr = false;
  bool browser = false;
};

std::optional<int> ParseInviteOptions(int argc, char** argv, InviteOptions* options) {
  CLI::App app(
      "Prints a link that lets another host or person take part in a session, and a QR code of it\n"
      "on a terminal. Whoever has the link has the role: send it as you would send a password.\n"
      "Where the session lets browsers in (skein launch --web-public), the QR code is of a link "
      "that\n"
      "a phone opens; --browser prints such links alone, with the fingerprint (SHA-256) of the\n"
      "certificate that the https page asks to compare.",
      "skein invite");
  app.add_option("--session", options->session_dir, "Session folder, on its host")->required();
  app.add_option("--role", options->role,
                 "agent (offers photos, reads), worker (computes), operator (commands, and what an "
                 "agent may) or viewer (reads)")
      ->required()
      ->check(CLI::IsMember({"agent", "worker", "operator", "viewer"}));
  app.add_option("--name", options->name,
                 "Of the agent, host or person: 1 to 24 letters, digits, '-' or '_' (default: the "
                 "role with a number)");
  app.add_option("--expires", options->expires,
                 "After a number of s, m, h or d, e.g. 12h (default: never)");
  app.add_option("--lcm-url", options->lcm_url,
                 "Where the session is heard (default: where `skein launch` runs it)");
  app.add_flag("--qr", options->qr, "The QR code also where the output is no terminal");
  app.add_flag("--browser", options->browser,
               "Only links for a browser: https, and http where the session has such a port");
  app.add_option("--view", options->view,
                 "Only a link for a browser of this host, by the address of the live view that "
                 "`skein launch` prints: http://127.0.0.1:8470");
  const std::optional<int> exit_code = ParseOptions(&app, argc, argv);
  if (!options->view.empty()) options->browser = true;
  return exit_code;
}

std::string NameOf(const InviteOptions& options) {
  if (options.name.empty()) return options.role + "-" + std::to_string(RandomU64() % 1'000'000);
  if (IsInvitedName(options.name)) return options.name;
  throw std::invalid_argument("--name " + options.name +
                              ": give 1 to 24 letters, digits, '-' or '_'");
}

LcmUrl UrlOf(const InviteOptions& options) {
  const Result<std::string> launched = options.lcm_url.empty()
                                           ? LaunchedUrl(SessionPaths{options.session_dir})
                                           : Result<std::string>(options.lcm_url);
  if (!launched.ok()) throw std::invalid_argument(launched.error());
  const std::string& text = *launched;
  if (text.empty()) throw std::invalid_argument("`skein launch` has not run here: give --lcm-url");
  LcmUrl url = ParseLcmUrl(text);
  if (!url.leaves_host()) {
    std::cerr << "skein invite: " << url.ToString()
              << " is heard on this host alone; for others launch with --lcm-url tcpqs://HOST:7700"
              << std::endl;
  }
  return url;
}

// What both kinds of link say.
struct Invited {
  Session session;
  Role role;
  std::string name;
  int64_t expires_s;
};

Invited InvitedBy(const InviteOptions& options) {
  const Result<Session> session = OpenSession(options.session_dir);
  if (!session.ok()) throw std::runtime_error(session.error());
  return {*session, *RoleFromName(options.role), NameOf(options), ExpiryOf(options.expires)};
}

// Addresses at which the session lets browsers of that role in.
std::vector<std::string> AddressesFor(const InviteOptions& options) {
  if (options.role == "worker") return {};
  if (!options.view.empty()) return {OwnViewOf(options.view)};
  const auto addresses = BrowserAddresses(SessionPaths{options.session_dir});
  if (addresses.ok()) return *addresses;
  if (options.browser) throw std::invalid_argument(addresses.error());
  std::cerr << "skein invite: no link for a browser: " << addresses.error() << std::endl;
  return {};
}

std::vector<std::string> BrowserLinks(const InviteOptions& options, const Invited& invited) {
  std::vector<std::string> links = AddressesFor(options);
  if (links.empty()) return links;
  const Result<std::string> pass =
      IssueWebPass(invited.session.paths.Keys().string(), invited.session.session_id,
                   {invited.role, invited.name, invited.expires_s});
  if (!pass.ok()) throw std::runtime_error(pass.error());
  for (std::string& link : links) link = BrowserLink(link, invited.role, *pass);
  return links;
}

// For the person who holds the code out. Links begin with skein://, https:// or http://.
std::string WhatCodeIs(const std::string& link) {
  if (link.rfind("https:", 0) == 0) return "The code is the https link:";
  if (link.rfind("http:", 0) == 0) return "The code is the http link, which is not encrypted:";
  return "The code is the skein link, for another host:";
}

void PrintBrowserLinks(const InviteOptions& options, const Invited& invited,
                       const std::vector<std::string>& links) {
  for (const std::string& link : links) std::cout << link << std::endl;
  if (!options.view.empty()) return;
  const Result<std::string> fingerprint = ReadWebFingerprint(invited.session.paths.Keys().string());
  if (fingerprint.ok()) std::cout << "certificate, SHA-256: " << *fingerprint << std::endl;
}

}  // namespace

std::string OwnViewOf(std::string view) {
  while (!view.empty() && view.back() == '/') view.pop_back();
  for (const std::string host : {"http://127.0.0.1:", "http://localhost:", "http://[::1]:"}) {
    const bool is_there = view.size() > host.size() && view.compare(0, host.size(), host) == 0 &&
                          view.find_first_not_of("0123456789", host.size()) == std::string::npos;
    if (is_there) return view;
  }
  throw std::invalid_argument("--view " + view + ": give an address of this host, as " +
                              "http://127.0.0.1:8470");
}

int64_t ExpiryOf(const std::string& duration) {
  if (duration.empty()) return 0;
  int64_t count = 0;
  const char* end = duration.data() + duration.size();
  const auto read = std::from_chars(duration.data(), end, count);
  const std::string unit(read.ptr, end);
  const int64_t unit_s = unit == "s" ? 1 : unit == "m" ? 60 : unit == "h" ? 3600 : 86400;
  if (read.ec != std::errc() || count <= 0 || count > 100'000'000 ||
      (unit != "s" && unit != "m" && unit != "h" && unit != "d")) {
    throw std::invalid_argument("--expires " + duration + ": give a number of s, m, h or d: 12h");
  }
  return NowUs() / 1'000'000 + count * unit_s;
}

Invitation MakeInvitation(const Session& session, LcmUrl url, Role role, const std::string& name,
                          int64_t expires_s) {
  const std::string keys = session.paths.Keys().string();
  const Result<SessionAccess> access =
      IssueInvitation(keys, session.session_id, role, name, expires_s);
  if (!access.ok()) throw std::runtime_error(access.error());
  if (url.provider == "tcpqs" && url.pin.empty()) {
    const Result<std::string> pin = ReadRelayPin(keys);
    if (!pin.ok()) throw std::runtime_error(pin.error());
    url.pin = *pin;
  }
  return {url, access->trust, access->credential};
}

int RunInvite(int argc, char** argv) {
  InviteOptions options;
  if (const auto exit_code = ParseInviteOptions(argc, argv, &options)) return *exit_code;
  try {
    const Invited invited = InvitedBy(options);
    const std::vector<std::string> browser_links = BrowserLinks(options, invited);
    if (options.browser && browser_links.empty()) {
      throw std::invalid_argument(
          options.role == "worker"
              ? "--browser: a worker has no page; agents, operators and viewers have one"
              : "--browser: no browser is let in; start the session with `skein launch "
                "--web-public HOST`");
    }
    const bool on_terminal = isatty(STDOUT_FILENO) != 0;
    std::string shown;
    if (!options.browser) {
      shown = ToLink(MakeInvitation(invited.session, UrlOf(options), invited.role, invited.name,
                                    invited.expires_s));
      std::cout << shown << std::endl;
    }
    if (options.browser || on_terminal) {
      if (!browser_links.empty()) {
        PrintBrowserLinks(options, invited, browser_links);
        shown = browser_links.back();  // the plain one, where there is one
      }
    }
    if (options.qr || on_terminal) std::cout << WhatCodeIs(shown) << "\n" << QrCode(shown);
    return kExitOk;
  } catch (const std::invalid_argument& error) {
    std::cerr << "skein invite: " << error.what() << std::endl;
    return kExitUsage;
  }
}

}  // namespace skein
