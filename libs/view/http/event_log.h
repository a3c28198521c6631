#pragma once

#include <cstdint>
#include <mutex>
#include <string>
#include <vector>

namespace skein {

// The session's events as JSON texts, in the order of the ledger. About 1 KB a photo. Any thread.
class EventLog {
 public:
  static constexpr int kMaxEvents = 2000;

  // The fact of that seq; seqs go on from 1. `event`: "" if the fact is no event.
  void Append(int64_t seq, std::string event);

  int64_t head() const;

  struct Page {
    int64_t head = 0;    // of the ledger
    int64_t next = 0;    // seq to ask for next; head + 1 where nothing is left
    std::string events;  // JSON values, separated by commas; "" if there are none
  };
  // Events with from_seq <= seq <= to_seq, at most max_events.
  Page Get(int64_t from_seq, int max_events = kMaxEvents, int64_t to_seq = INT64_MAX) const;

 private:
  struct Event {
    int64_t seq;
    std::string text;
  };

  mutable std::mutex mutex_;
  int64_t head_ = 0;
  std::vector<Event> events_;
};

}  // namespace skein
