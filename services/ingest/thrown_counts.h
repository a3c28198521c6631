// Counts exceptions for each photo or fact. An unanswered sender repeats its item, which would
// raise the exception again; after kMaxFailures exceptions the item is refused.
#pragma once

#include <map>
#include <string>

#include "core/attempt.h"

namespace skein {

class ThrownCounts {
 public:
  // Counts an exception of `key`. Returns true at the kMaxFailures-th one, and sets the count to 0.
  bool Note(const std::string& key) {
    if (counts_.size() >= kMaxKeys && counts_.count(key) == 0) counts_.clear();
    if (++counts_[key] < kMaxFailures) return false;
    counts_.erase(key);
    return true;
  }

 private:
  static constexpr size_t kMaxKeys = 10'000;  // bounds the memory: keys come from senders

  std::map<std::string, int> counts_;
};

}  // namespace skein
