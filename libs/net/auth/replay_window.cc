#include "auth/replay_window.h"

#include <algorithm>

namespace skein {

bool ReplayWindow::Accept(uint64_t counter) {
  if (counter <= floor_) return false;
  const auto place = std::lower_bound(seen_.begin(), seen_.end(), counter);
  if (place != seen_.end() && *place == counter) return false;
  seen_.insert(place, counter);
  highest_ = std::max(highest_, counter);
  // Half a window at a time, so that a message in order costs no move of all.
  if (seen_.size() >= 2 * kSize) {
    const auto kept = seen_.end() - kSize;
    floor_ = *(kept - 1);
    seen_.erase(seen_.begin(), kept);
  }
  return true;
}

}  // namespace skein
