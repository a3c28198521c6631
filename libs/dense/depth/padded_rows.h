// Rows of bytes that vectors may be loaded from beyond both ends.
#pragma once

#include <cstdint>
#include <vector>

#include "depth/sweep_kernels.h"

namespace skein {

inline int RoundUp(int value, int multiple) { return (value + multiple - 1) / multiple * multiple; }

// kSweepMargin bytes before each row and behind it.
class PaddedRows {
 public:
  void Resize(int width, int rows) {
    stride_ = RoundUp(width + 2 * kSweepMargin, 64);
    bytes_.assign(static_cast<size_t>(stride_) * rows, 0);
  }
  uint8_t* Row(int i) { return bytes_.data() + static_cast<size_t>(stride_) * i + kSweepMargin; }

 private:
  std::vector<uint8_t> bytes_;
  int stride_ = 0;
};

}  // namespace skein
