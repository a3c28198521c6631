#include "transport/decode.h"

#include <cstdint>

namespace skein {
namespace {

constexpr size_t kFingerprintBytes = 8;

// Big endian.
bool ReadLength(const uint8_t* data, size_t size, size_t at, int64_t* length) {
  if (at > size || size - at < 4) return false;
  const uint32_t value = uint32_t{data[at]} << 24 | uint32_t{data[at + 1]} << 16 |
                         uint32_t{data[at + 2]} << 8 | data[at + 3];
  *length = static_cast<int32_t>(value);
  return *length >= 0;
}

}  // namespace

bool ArrayFits(const void* data, size_t size, const ArrayLayout& layout) {
  const auto* bytes = static_cast<const uint8_t*>(data);
  size_t at = kFingerprintBytes;
  int64_t length = 0;
  for (const char* field = layout.before; *field != 0; ++field) {
    if (*field == 's') {
      if (!ReadLength(bytes, size, at, &length)) return false;
      at += 4 + static_cast<size_t>(length);
    } else {
      at += static_cast<size_t>(*field - '0');
    }
  }
  if (!ReadLength(bytes, size, at, &length)) return false;
  return static_cast<size_t>(length) * layout.element_bytes <= size - at - 4;
}

}  // namespace skein
