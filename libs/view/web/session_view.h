#pragma once

#include <shared_mutex>
#include <utility>

#include "http/event_log.h"
#include "session/session_history.h"
#include "session/session_tally.h"

namespace skein {

// The session as the live view reads it: the ledger folded, and its events. One thread applies
// facts, any reads.
class SessionView {
 public:
  // Facts in the order of seq. An exception on the way becomes BrokenState (core/attempt.h).
  void Apply(const Fact& fact);

  const EventLog& events() const { return events_; }

  // read(const SessionRecord&), which must not keep a reference to it. Facts wait meanwhile.
  template <class Read>
  auto With(Read read) const {
    const std::shared_lock<std::shared_mutex> lock(mutex_);
    return read(std::as_const(record_));
  }
  // The same with read(const SessionRecord&, const SessionTally&).
  template <class Read>
  auto WithTally(Read read) const {
    const std::shared_lock<std::shared_mutex> lock(mutex_);
    return read(std::as_const(record_), std::as_const(tally_));
  }

 private:
  mutable std::shared_mutex mutex_;
  SessionRecord record_;
  SessionTally tally_;
  EventLog events_;
};

}  // namespace skein
