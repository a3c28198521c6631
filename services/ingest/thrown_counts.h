// Exceptions on photos and facts that come again when nobody answers for them.
#pragma once

#include <map>
#include <string>

#include "core/attempt.h"

namespace skein {

class ThrownCounts {
 public:
  // True: for the kMaxFailures-th time, from which on the key counts anew.
  bool Note(const std::string& key) {
    if (counts_.size() >= kMaxKeys && counts_.count(key) == 0) counts_.clear();
    if (++counts_[key] < kMaxFailures) return false;
    counts_.erase(key);
    return true;
  }

 private:
  static constexpr size_t kMaxKeys = 10'000;  // anybody may offer

  std::map<std::string, int> counts_;
};

}  // namespace skein
