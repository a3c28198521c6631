// Invitations by their name, in the session's folder: who was invited (keys/invited), and who no
// more is (keys/revoked).
//
// A name stays revoked: whoever gets another invitation gets another name. The record of who was
// invited decides nothing about messages: it tells a name that is to be revoked from a typo.
// Processes with the session's folder hold to it: ingest, which alone writes what counts, and the
// relays, behind which the others are. Elsewhere nobody knows of it, nor needs to.
#pragma once

#include <set>
#include <string>

#include "core/clock.h"
#include "core/result.h"

namespace skein {

using InvitedNames = std::set<std::string>;
using RevokedNames = std::set<std::string>;

// `dir` is the folder keys/. Empty where nothing was revoked.
Result<RevokedNames> ReadRevokedNames(const std::string& dir);

// The revoked among them. Not those that a version of Skein invited which kept no record.
Result<InvitedNames> ReadInvitedNames(const std::string& dir);

// Records that the name is invited. Makes the folder where it is missing. Fails for a name that is
// revoked or of a process of this host, where nobody can know, and where it cannot be written.
Status RecordInvitation(const std::string& dir, const std::string& name);

// From now on, whether invited or not. Fails for the name of a process of this host, whose
// credential is in the folder, unless it was invited before that process came.
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
