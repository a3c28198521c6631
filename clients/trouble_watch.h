// Troubles of a session, for whoever takes its photos from a terminal.
#pragma once

#include <map>
#include <memory>
#include <ostream>
#include <string>
#include <vector>

#include "clients/process_watch.h"
#include "node/ledger_follower.h"
#include "session/troubles.h"

namespace skein {

// Finds what the page, the phone and `skein status` show (session/troubles.h). The ledger is read
// only while a stage lacks a process: to an agent on a thin link it is much. Loop's thread only;
// the node outlives it.
class TroubleWatch {
 public:
  explicit TroubleWatch(Node& node) : node_(node), heard_(node) {}

  // A line on `out` for each trouble that has come, with what to do, and one when it is over. To be
  // called once a second.
  void TellChange(const std::string& command, std::ostream& out);

 private:
  void FollowLedger();
  std::vector<Trouble> Find();

  Node& node_;
  ProcessWatch heard_;
  SessionState state_;  // of the ledger that is followed
  std::unique_ptr<LedgerFollower> follower_;
  bool has_read_ledger_ = false;
  std::map<std::string, std::string> told_;  // sentences, by key
};

}  // namespace skein
