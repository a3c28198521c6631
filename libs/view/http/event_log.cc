#include "http/event_log.h"

#include <algorithm>
#include <utility>

namespace skein {

void EventLog::Append(int64_t seq, std::string event) {
  const std::lock_guard<std::mutex> lock(mutex_);
  head_ = std::max(head_, seq);
  if (event.empty()) return;
  event.shrink_to_fit();
  events_.push_back({seq, std::move(event)});
}

int64_t EventLog::head() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return head_;
}

EventLog::Page EventLog::Get(int64_t from_seq, int max_events, int64_t to_seq) const {
  const std::lock_guard<std::mutex> lock(mutex_);
  Page page;
  page.head = head_;
  page.next = head_ + 1;
  auto event = std::lower_bound(events_.begin(), events_.end(), from_seq,
                                [](const Event& e, int64_t seq) { return e.seq < seq; });
  for (int n = 0; event != events_.end() && event->seq <= to_seq; ++event, ++n) {
    if (n == max_events) {
      page.next = event->seq;
      break;
    }
    if (n > 0) page.events += ',';
    page.events += event->text;
  }
  return page;
}

}  // namespace skein
