#pragma once

#include <cstdint>
#include <optional>

#include "photo/byte_peeker.h"
#include "photo/byte_view.h"

namespace skein {

// The first image file directory of a TIFF, in which an entry has 12 bytes: tag, type, count, value
// (TIFF 6.0, section 2). Claims nothing of bytes that are not there. The bytes must outlive it.
class TiffDirectory {
 public:
  explicit TiffDirectory(ByteView tiff);

  // First value of a SHORT or LONG entry; nothing without one.
  std::optional<uint32_t> Find(uint32_t tag) const;

  // Content of a BYTE, ASCII or UNDEFINED entry of more than four bytes; empty without one.
  ByteView FindBytes(uint32_t tag) const;

 private:
  std::optional<size_t> FindEntry(uint32_t tag) const;

  ByteView tiff_;
  BytePeeker peek_;
  size_t begin_ = ~size_t{0};
};

}  // namespace skein
