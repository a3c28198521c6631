#pragma once

#include <cstdint>

#include "core/result.h"
#include "photo/byte_view.h"

namespace skein {

enum class PhotoFormat { kJpeg, kPng, kTiff };

// Claims of a photo's header. Nothing is decoded to learn it, so it costs the same for a bomb.
struct PhotoHeader {
  PhotoFormat format = PhotoFormat::kJpeg;
  int64_t width_px = 0;
  int64_t height_px = 0;
  int channels = 0;          // 1 grey, 3 colour, 4 CMYK (JPEG) or with alpha
  int bits_per_channel = 0;  // 0 if the header doesn't say
};

// Each side is below 2^32 by its format, so the product fits.
inline uint64_t NumPixels(const PhotoHeader& header) {
  return static_cast<uint64_t>(header.width_px) * static_cast<uint64_t>(header.height_px);
}

// The largest of 1, 2, 4 and 8 by which both sides can be divided while decoding, so that the
// longest is `min_side_px` or more: JPEG alone has this, as fewer frequencies of each block are
// transformed.
int ReductionFor(const PhotoHeader& header, int64_t min_side_px);

// A side of the reduced photo.
inline int64_t ReducedSide(int64_t side_px, int reduction) {
  return (side_px + reduction - 1) / reduction;
}

// An error says what the bytes are instead: too short, not a JPEG, PNG or TIFF, or without size.
Result<PhotoHeader> ReadPhotoHeader(ByteView bytes);

// Starts of scan in a JPEG up to its end of image, at most `most`. Decoding goes through all blocks
// of a scan's components for each, whatever its bytes. Not fewer than libjpeg finds.
int CountJpegScans(ByteView jpeg, int most);

// Chunks of a PNG up to its end, at most `most`, that hold compressed content beside the pixels:
// texts and colour profiles (zTXt, iTXt, iCCP). Not fewer than libpng finds.
int CountPngTexts(ByteView png, int most);

const char* FormatName(PhotoFormat format);

}  // namespace skein
