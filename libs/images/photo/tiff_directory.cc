#include "photo/tiff_directory.h"

namespace skein {
namespace {

enum Type : uint32_t { kByte = 1, kAscii = 2, kShort = 3, kLong = 4, kUndefined = 7 };

}  // namespace

TiffDirectory::TiffDirectory(ByteView tiff)
    : tiff_(tiff), peek_(tiff, !tiff.empty() && tiff[0] == 'M') {
  if (const auto at = peek_.Get(4, 4)) begin_ = *at;
}

std::optional<size_t> TiffDirectory::FindEntry(uint32_t tag) const {
  const uint32_t count = peek_.Get(begin_, 2).value_or(0);
  for (uint32_t i = 0; i < count; ++i) {
    const size_t entry = begin_ + 2 + 12 * static_cast<size_t>(i);
    if (peek_.Get(entry, 2) == tag) return entry;
  }
  return std::nullopt;
}

// Several SHORTs lie at an offset, equal in practice.
std::optional<uint32_t> TiffDirectory::Find(uint32_t tag) const {
  const std::optional<size_t> entry = FindEntry(tag);
  if (!entry) return std::nullopt;
  const uint32_t type = peek_.Get(*entry + 2, 2).value_or(0);
  const uint32_t count = peek_.Get(*entry + 4, 4).value_or(0);
  const size_t size = type == kShort ? 2 : 4;
  if (type != kShort && type != kLong) return std::nullopt;
  if (count * size <= 4) return peek_.Get(*entry + 8, size);
  return peek_.Get(peek_.Get(*entry + 8, 4).value_or(~0u), size);
}

ByteView TiffDirectory::FindBytes(uint32_t tag) const {
  const std::optional<size_t> entry = FindEntry(tag);
  if (!entry) return {};
  const uint32_t type = peek_.Get(*entry + 2, 2).value_or(0);
  const size_t count = peek_.Get(*entry + 4, 4).value_or(0);
  const size_t at = peek_.Get(*entry + 8, 4).value_or(~0u);
  const bool is_bytes = type == kByte || type == kAscii || type == kUndefined;
  if (!is_bytes || count <= 4 || at > tiff_.size() || count > tiff_.size() - at) return {};
  return {tiff_.data() + at, count};
}

}  // namespace skein
