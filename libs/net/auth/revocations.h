// Invitations by their name, in the session's folder: who was invited (keys/invited), and who no
// more is (keys/revoked).
//
// A name stays revoked: whoever gets another invitation gets another name. The record of who was
// invited decides nothing about messages: it tells a name that is to be revoked from a typo.
// Processes with the session's folder hold to it: ingest, which alone writes what counts, and the
// relays, behind which the others are. Elsewhere nobody knows of it, nor needs to.
#pragma once

#include <functional>
#include <memory>
#include <set>
#include <string>
#include <utility>

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

// The names as the file was last read.
class RevokedList {
 public:
  explicit RevokedList(std::string dir) : dir_(std::move(dir)) {}

  // Reads the file where it is another than the one that was read. If the new file cannot be read,
  // the names read before stay.
  void Refresh();
  const RevokedNames& names() const { return names_; }

 private:
  std::string dir_;
  RevokedNames names_;
  std::string read_as_;  // stat of the file that was read
};

// Follows the file while a process runs: looks at it at most once a second, when it is asked. A
// look is a stat(2), 1.2 us on a local file, so nodes and relays take it on their loops.
class Revocations {
 public:
  explicit Revocations(std::string dir, Clock clock = MonotonicS);

  bool operator()(const std::string& name);

 private:
  RevokedList list_;
  Clock clock_;
  double next_look_s_ = -1e300;
};

// The same for a thread that must not wait for the disk: answers with what the last look found.
// Copies are one. Any thread.
class WatchedRevocations {
 public:
  // Runs a job, at once or on another thread.
  using RunJob = std::function<void(std::function<void()>)>;

  // Reads the file.
  WatchedRevocations(const std::string& dir, RunJob run_job);

  // To be called once a second: has the file looked at by a job, unless one is at it still.
  void Look();
  bool operator()(const std::string& name) const;

 private:
  struct Known;

  RunJob run_job_;
  std::shared_ptr<Known> known_;
};

}  // namespace skein
