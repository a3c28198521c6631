// Photos in the High Efficiency Image File Format, which are not taken, and what to do with them.
#pragma once

#include <cstddef>

#include "photo/byte_view.h"

namespace skein {

// So many first bytes of a file tell it.
constexpr size_t kHeifHeadBytes = 64;

// "HEIC" or "AVIF" by the brands in the file's first box (ISO/IEC 14496-12, 4.3; ISO/IEC 23008-12,
// 10.2 and the AVIF specification, 9.1.1), whatever the file is called; null for any other file.
const char* HeifName(ByteView file);

// A part of a sentence that says how to get photos that are taken.
constexpr char kHeifAdvice[] =
    "iPhone: Settings > Camera > Formats > Most Compatible, or when sharing Options > Most "
    "Compatible; for files that are there: heif-convert (Debian's libheif-examples)";

}  // namespace skein
