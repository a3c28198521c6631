// Invitations that were taken back, by their name, in the session's folder: keys/revoked.
//
// A name stays revoked: whoever gets another invitation gets another name. Processes with the
// session's folder hold to it: ingest, which alone writes what counts, and the relays, behind which
// the others are. Elsewhere nobody knows of it, nor needs to.
#pragma once

#include <set>
#include <string>

#include "core/clock.h"
#include "core/result.h"

namespace skein {

using RevokedNames = std::set<std::string>;

// `dir` is the folder keys/. Empty where nothing was revoked.
Result<RevokedNames> ReadRevokedNames(const std::string& dir);

// OK for a name that may be invited. An error says why not, also where nobody can know.
Status RequireUnrevoked(const std::string& dir, const std::string& name);

// From now on. Fails for the name of a process of this host, whose credential is in the folder.
Status RevokeName(const std::string& dir, const std::string& name);

// Follows the file while a process runs: looks at it at most once a second. Where it cannot be read
// what was known stays.
class Revocations {
 public:
  explicit Revocations(std::string dir, Clock clock = MonotonicS);

  bool operator()(const std::string& name);

 private:
  void Refresh();

  std::string dir_;
  Clock clock_;
  RevokedNames names_;
  std::string read_as_;  // what the file system told of the file that was read
  double next_look_s_ = -1e300;
};

}  // namespace skein
