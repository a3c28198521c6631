#pragma once

#include <cstdint>

#include "core/bytes.h"
#include "core/result.h"

namespace skein {

enum class PhotoFormat { kJpeg, kPng, kTiff };

// What a photo's header claims. Nothing is decoded to learn it, so it costs the same for a bomb.
struct PhotoHeader {
  PhotoFormat format = PhotoFormat::kJpeg;
  int64_t width_px = 0;
  int64_t height_px = 0;
  int channels = 0;          // 1 grey, 3 colour, 4 CMYK (JPEG) or with alpha
  int bits_per_channel = 0;  // 0 if the header doesn't say
};

// An error says what the bytes are instead: too short, not a JPEG, PNG or TIFF, or without size.
Result<PhotoHeader> ReadPhotoHeader(const Bytes& bytes);

const char* FormatName(PhotoFormat format);

}  // namespace skein
