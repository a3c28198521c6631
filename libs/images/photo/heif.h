// Recognises photos in the High Efficiency Image File Format, which Skein does not decode.
#pragma once

#include <cstddef>

#include "photo/byte_view.h"

namespace skein {

// HeifName reads at most so many bytes from the start of a file.
constexpr size_t kHeifHeadBytes = 64;

// "HEIC" or "AVIF" by the brands in the file's first box (ISO/IEC 14496-12, 4.3; ISO/IEC 23008-12,
// 10.2 and the AVIF specification, 9.1.1), whatever the file is called; null for any other file.
const char* HeifName(ByteView file);

// Advice for the photographer, a part of a sentence: how to get JPEGs from the phone or from files.
constexpr char kHeifAdvice[] =
    "iPhone: Settings > Camera > Formats > Most Compatible, or when sharing Options > Most "
    "Compatible; for files that are there: heif-convert (Debian's libheif-examples)";

}  // namespace skein
