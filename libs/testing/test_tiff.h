// Text tags of TIFF files, read without a library.
#pragma once

#include <cstdint>
#include <cstring>
#include <filesystem>
#include <string>

#include "core/file.h"

namespace skein {

// Text of a tag in the first directory of a little-endian TIFF file, without its last 0. Empty: the
// file has no such text.
inline std::string TiffText(const std::filesystem::path& path, uint16_t wanted) {
  const Bytes file = *ReadFile(path.string());
  const auto number = [&](size_t at, size_t bytes) {
    uint32_t value = 0;
    if (at + bytes <= file.size()) std::memcpy(&value, file.data() + at, bytes);
    return value;
  };
  constexpr uint32_t kMagic = 0x002a4949, kAscii = 2;
  constexpr size_t kEntryBytes = 12;
  if (number(0, 4) != kMagic) return "";
  const size_t directory = number(4, 4);
  for (size_t i = 0; i < number(directory, 2); ++i) {
    const size_t entry = directory + 2 + kEntryBytes * i;
    if (number(entry, 2) != wanted || number(entry + 2, 2) != kAscii) continue;
    const size_t count = number(entry + 4, 4);
    const size_t at = count <= 4 ? entry + 8 : number(entry + 8, 4);
    if (count == 0 || at + count > file.size()) return "";
    return std::string(reinterpret_cast<const char*>(file.data()) + at, count - 1);
  }
  return "";
}

}  // namespace skein
