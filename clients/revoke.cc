#include "clients/revoke.h"

#include <CLI/CLI.hpp>
#include <iostream>
#include <string>

#include "auth/revocations.h"
#include "auth/session_keys.h"
#include "clients/subcommand.h"
#include "ledger/session_folder.h"
#include "photo/photo_name.h"

namespace skein {
namespace {

// A name that nobody is known to have been invited by is revoked, too: who was invited before there
// was a record is shut out, and a typo shuts out nobody.
int Revoke(const std::string& keys, const std::string& name) {
  const Status status = RevokeName(keys, name);
  if (!status.ok()) throw std::runtime_error(status.error());
  const Result<InvitedNames> invited = ReadInvitedNames(keys);
  if (invited.ok() && invited->count(name) > 0) {
    std::cout << "revoked: " << name << std::endl;
    if (!HasCredentialOf(keys, name)) return kExitOk;
    std::cerr << "skein revoke: a process of this host has the same name, and is shut out, too: "
                 "start it under another"
              << std::endl;
    return kExitOk;
  }
  std::string names;
  if (invited.ok()) {
    for (const std::string& each : *invited) names += (names.empty() ? "" : ", ") + each;
  }
  std::cerr << "skein revoke: nobody is known to have been invited as \"" << Printable(name)
            << "\" (invited: " << (names.empty() ? "nobody known" : names)
            << "); the name is revoked all the same" << std::endl;
  return kExitError;
}

}  // namespace

int RunRevoke(int argc, char** argv) {
  std::string session_dir;
  std::string name;
  CLI::App app(
      "Takes an invitation back, as of a phone that was lost: from now on the session refuses "
      "what\n"
      "comes under its name, and the relay sends it nothing. What it sent before stays.\n"
      "Exit code 1 where nobody is known to have been invited by that name.",
      "skein revoke");
  app.add_option("--session", session_dir, "Session folder, on its host")->required();
  app.add_option("--name", name, "As given to `skein invite` (default: print those revoked)");
  if (const auto exit_code = ParseOptions(&app, argc, argv)) return *exit_code;
  const Result<Session> session = OpenSession(session_dir);
  if (!session.ok()) throw std::runtime_error(session.error());
  const std::string keys = session->paths.Keys().string();
  if (!name.empty()) return Revoke(keys, name);
  const Result<RevokedNames> revoked = ReadRevokedNames(keys);
  if (!revoked.ok()) throw std::runtime_error(revoked.error());
  for (const std::string& each : *revoked) std::cout << each << "\n";
  return kExitOk;
}

}  // namespace skein
