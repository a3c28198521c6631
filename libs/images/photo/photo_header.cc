#include "photo/photo_header.h"

#include <algorithm>
#include <cstring>
#include <string>

#include "photo/byte_peeker.h"
#include "photo/heif.h"
#include "photo/tiff_directory.h"

namespace skein {
namespace {

bool StartsWith(ByteView bytes, const void* prefix, size_t size) {
  return bytes.size() >= size && std::memcmp(bytes.data(), prefix, size) == 0;
}

// Start of frame of any coding process (ITU-T T.81, table B.1), which holds the size.
bool IsStartOfFrame(uint32_t marker) {
  return marker >= 0xc0 && marker <= 0xcf && marker != 0xc4 && marker != 0xc8 && marker != 0xcc;
}

constexpr uint8_t kEndOfImage = 0xd9;
constexpr uint8_t kStartOfScan = 0xda;

bool HasNoLength(uint32_t marker) { return marker == 0x01 || (marker >= 0xd0 && marker <= 0xd8); }

Result<PhotoHeader> ReadJpeg(ByteView bytes) {
  const BytePeeker peek(bytes, true);
  for (size_t at = 2; peek.Get(at, 2);) {
    if (bytes[at] != 0xff) return DataLoss("damaged JPEG: no marker where one must be");
    const uint32_t marker = bytes[at + 1];
    if (marker == 0xff || HasNoLength(marker)) {
      at += marker == 0xff ? 1 : 2;
      continue;
    }
    const auto length = peek.Get(at + 2, 2);
    if (marker == kEndOfImage || marker == kStartOfScan || !length || *length < 2) break;
    if (IsStartOfFrame(marker)) {
      const auto bits = peek.Get(at + 4, 1), height = peek.Get(at + 5, 2);
      const auto width = peek.Get(at + 7, 2), channels = peek.Get(at + 9, 1);
      if (!channels) break;
      return PhotoHeader{PhotoFormat::kJpeg, *width, *height, static_cast<int>(*channels),
                         static_cast<int>(*bits)};
    }
    at += 2 + *length;
  }
  return DataLoss("damaged JPEG: ends before the size of the image");
}

Result<PhotoHeader> ReadPng(ByteView bytes) {
  const BytePeeker peek(bytes, true);
  const auto width = peek.Get(16, 4), height = peek.Get(20, 4);
  const auto bits = peek.Get(24, 1), colour = peek.Get(25, 1);
  if (!colour || std::memcmp(bytes.data() + 12, "IHDR", 4) != 0) {
    return DataLoss("damaged PNG: no IHDR");
  }
  const bool grey = (*colour & 3) == 0;
  const int channels = (grey ? 1 : 3) + ((*colour & 4) != 0 ? 1 : 0);
  return PhotoHeader{PhotoFormat::kPng, *width, *height, channels, static_cast<int>(*bits)};
}

Result<PhotoHeader> ReadTiff(ByteView bytes) {
  const TiffDirectory directory(bytes);
  const auto width = directory.Find(256), height = directory.Find(257);
  if (!width || !height) return DataLoss("damaged TIFF: no size of the image");
  return PhotoHeader{PhotoFormat::kTiff, *width, *height,
                     static_cast<int>(directory.Find(277).value_or(1)),
                     static_cast<int>(directory.Find(258).value_or(1))};
}

// Name of a format that is often called .jpg, by its first bytes; null for any other.
const char* OtherFormatName(ByteView bytes) {
  const auto starts = [&](const char* text) { return StartsWith(bytes, text, std::strlen(text)); };
  constexpr size_t kRiffType = 8, kBoxType = 4;
  const auto has_at = [&](size_t at, const char* text) {
    return bytes.size() >= at + 4 && std::memcmp(bytes.data() + at, text, 4) == 0;
  };
  if (starts("RIFF") && has_at(kRiffType, "WEBP")) return "WebP";
  if (starts("GIF8")) return "GIF";
  if (has_at(kBoxType, "jP  ")) return "JPEG 2000";
  if (has_at(kBoxType, "JXL ") || starts("\xff\x0a")) return "JPEG XL";
  return nullptr;
}

}  // namespace

Result<PhotoHeader> ReadPhotoHeader(ByteView bytes) {
  if (bytes.empty()) return DataLoss("empty file");
  if (StartsWith(bytes, "\xff\xd8\xff", 3)) return ReadJpeg(bytes);
  if (StartsWith(bytes, "\x89PNG\r\n\x1a\n", 8)) return ReadPng(bytes);
  if (StartsWith(bytes, "II*\0", 4) || StartsWith(bytes, "MM\0*", 4)) return ReadTiff(bytes);
  if (const char* name = HeifName(bytes)) {
    return InvalidArgument(std::string(name) + " photo: JPEG, PNG and TIFF are taken. " +
                           kHeifAdvice);
  }
  if (const char* name = OtherFormatName(bytes)) {
    return InvalidArgument(std::string(name) +
                           " image, whatever its name says: JPEG, PNG and TIFF are taken");
  }
  return InvalidArgument("not a JPEG, PNG or TIFF photo");
}

// As libjpeg's next_marker: whatever lies between two markers, a scan's data with its stuffed zeros
// or anything else, is passed over.
int CountJpegScans(ByteView jpeg, int most) {
  int count = 0;
  const uint8_t* const end = jpeg.end();
  const uint8_t* at = jpeg.begin();
  while (count < most) {
    at = std::find(at, end, 0xff);
    at = std::find_if(at, end, [](uint8_t byte) { return byte != 0xff; });
    if (at == end || *at == kEndOfImage) break;
    const uint8_t marker = *at++;
    if (marker == 0 || HasNoLength(marker)) continue;
    if (marker == kStartOfScan) ++count;
    if (end - at < 2) break;
    at += std::min<ptrdiff_t>(end - at, std::max(2, at[0] << 8 | at[1]));
  }
  return count;
}

// As libpng goes: chunk by chunk, each by the length that it tells.
int CountPngTexts(ByteView png, int most) {
  constexpr size_t kFirstChunk = 8, kBeside = 12;  // length, type, checksum
  const BytePeeker peek(png, true);
  int count = 0;
  for (size_t at = kFirstChunk; count < most && at + kBeside <= png.size();) {
    const uint8_t* const type = png.data() + at + 4;
    const auto is = [type](const char* name) { return std::memcmp(type, name, 4) == 0; };
    if (is("IEND")) break;
    if (is("zTXt") || is("iTXt") || is("iCCP")) ++count;
    at += kBeside + size_t{*peek.Get(at, 4)};
  }
  return count;
}

const char* FormatName(PhotoFormat format) {
  switch (format) {
    case PhotoFormat::kJpeg:
      return "JPEG";
    case PhotoFormat::kPng:
      return "PNG";
    case PhotoFormat::kTiff:
      return "TIFF";
  }
  return "";
}

int ReductionFor(const PhotoHeader& header, int64_t min_side_px) {
  if (header.format != PhotoFormat::kJpeg) return 1;
  const int64_t longest_px = std::max(header.width_px, header.height_px);
  int reduction = 8;
  while (reduction > 1 && ReducedSide(longest_px, reduction) < min_side_px) reduction /= 2;
  return reduction;
}

}  // namespace skein
