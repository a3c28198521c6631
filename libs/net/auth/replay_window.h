// Window of one signer's message counters that were seen (RFC 4303, section 3.4.3).
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace skein {

// Takes each counter once, in any order among the last kSize. Counters need not be consecutive, so
// the window is one of messages, not of numbers.
class ReplayWindow {
 public:
  static constexpr size_t kSize = 1024;

  // Counters up to `floor` have been seen.
  explicit ReplayWindow(uint64_t floor = 0) : floor_(floor), highest_(floor) {}

  // False for one that was seen, or that is older than the window.
  bool Accept(uint64_t counter);
  uint64_t highest() const { return highest_; }

 private:
  uint64_t floor_;
  uint64_t highest_;
  std::vector<uint64_t> seen_;  // rising, all above floor_
};

}  // namespace skein
