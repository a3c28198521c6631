#include "clients/revoke.h"

#include <CLI/CLI.hpp>
#include <iostream>
#include <string>

#include "auth/revocations.h"
#include "clients/subcommand.h"
#include "ledger/session_folder.h"

namespace skein {

int RunRevoke(int argc, char** argv) {
  std::string session_dir;
  std::string name;
  CLI::App app(
      "Takes an invitation back, as of a phone that was lost: from now on the session refuses "
      "what\n"
      "comes under its name, and the relay sends it nothing. What it sent before stays.",
      "skein revoke");
  app.add_option("--session", session_dir, "Session folder, on its host")->required();
  app.add_option("--name", name, "As given to `skein invite` (default: print those revoked)");
  if (const auto exit_code = ParseOptions(&app, argc, argv)) return *exit_code;
  const Result<Session> session = OpenSession(session_dir);
  if (!session.ok()) throw std::runtime_error(session.error());
  const std::string keys = session->paths.Keys().string();
  if (!name.empty()) {
    const Status status = RevokeName(keys, name);
    if (!status.ok()) throw std::runtime_error(status.error());
  }
  const Result<RevokedNames> revoked = ReadRevokedNames(keys);
  if (!revoked.ok()) throw std::runtime_error(revoked.error());
  for (const std::string& each : *revoked) std::cout << each << "\n";
  return kExitOk;
}

}  // namespace skein
