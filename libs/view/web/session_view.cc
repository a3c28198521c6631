#include "web/session_view.h"

#include "core/attempt.h"
#include "web/events.h"

namespace skein {

// The event comes last: whoever reads it finds what it tells of.
void SessionView::Apply(const Fact& fact) {
  ChangeWhole([&] {
    {
      const std::unique_lock<std::shared_mutex> lock(mutex_);
      record_.Apply(fact);
      tally_.Apply(fact, record_.state);
    }
    events_.Append(Header(fact).seq, EventOf(fact));
  });
}

}  // namespace skein
