#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>

#include "photo/byte_view.h"

namespace skein {

// Unsigned integers of 1..4 bytes at an offset; nothing beyond the end.
class BytePeeker {
 public:
  BytePeeker(ByteView bytes, bool big_endian) : bytes_(bytes), big_endian_(big_endian) {}

  std::optional<uint32_t> Get(size_t at, size_t size) const {
    if (at > bytes_.size() || size > bytes_.size() - at) return std::nullopt;
    uint32_t value = 0;
    for (size_t i = 0; i < size; ++i) {
      value = value << 8 | bytes_[at + (big_endian_ ? i : size - 1 - i)];
    }
    return value;
  }

 private:
  ByteView bytes_;
  bool big_endian_;
};

}  // namespace skein
