// Exceptions on photos and facts that come again when nobody answers for them.
#pragma once

#include <map>
#include <string>

namespace skein {

constexpr int kMaxThrown = 3;  // then an item is refused

class ThrownCounts {
 public:
  // True: for the kMaxThrown-th time, from which on the key counts anew.
  bool Note(const std::string& key) {
    if (counts_.size() >= kMaxKeys && counts_.count(key) == 0) counts_.clear();
    if (++counts_[key] < kMaxThrown) return false;
    counts_.erase(key);
    return true;
  }

 private:
  static constexpr size_t kMaxKeys = 10'000;  // anybody may offer

  std::map<std::string, int> counts_;
};

}  // namespace skein
