// For tests: photos that are made to cost more than a photo may. A test that includes this links
// ZLIB::ZLIB.
#pragma once

#include <zlib.h>

#include <algorithm>
#include <cstdint>
#include <stdexcept>
#include <string>

#include "core/bytes.h"

namespace skein {

inline void WriteBigEndian(uint32_t value, uint8_t* out) {
  for (const int shift : {24, 16, 8, 0}) *out++ = static_cast<uint8_t>(value >> shift);
}

inline void AppendBigEndian(uint32_t value, Bytes* out) {
  out->resize(out->size() + 4);
  WriteBigEndian(value, out->data() + out->size() - 4);
}

// `size` zeros, a thousandth of it when deflated.
inline Bytes DeflatedZeros(size_t size) {
  const Bytes zeros(size);
  uLongf deflated_size = compressBound(size);
  Bytes deflated(deflated_size);
  if (compress2(deflated.data(), &deflated_size, zeros.data(), size, Z_BEST_SPEED) != Z_OK) {
    throw std::logic_error("zlib cannot deflate zeros");
  }
  deflated.resize(deflated_size);
  return deflated;
}

// A chunk of a PNG: length, type, content, checksum.
inline Bytes PngChunk(const std::string& type, const Bytes& content) {
  constexpr size_t kHead = 8;
  Bytes chunk(kHead + content.size() + 4);
  WriteBigEndian(static_cast<uint32_t>(content.size()), chunk.data());
  std::copy_n(type.begin(), 4, chunk.begin() + 4);
  std::copy(content.begin(), content.end(), chunk.begin() + kHead);
  const uLong sum = crc32(0, chunk.data() + 4, static_cast<uInt>(chunk.size() - kHead));
  WriteBigEndian(static_cast<uint32_t>(sum), chunk.data() + chunk.size() - 4);
  return chunk;
}

// A chunk of type zTXt, iTXt or iCCP that inflates to what `deflated` does.
inline Bytes PngBomb(const std::string& type, const Bytes& deflated) {
  const bool is_international = type == "iTXt";  // compressed, without language and translation
  Bytes content = is_international ? Bytes{'k', 0, 1, 0, 0, 0} : Bytes{'k', 0, 0};
  content.insert(content.end(), deflated.begin(), deflated.end());
  return PngChunk(type, content);
}

// The PNG with these chunks between its header and its pixels.
inline Bytes WithPngChunks(const Bytes& png, const Bytes& chunks) {
  constexpr std::ptrdiff_t kPixels = 8 + 12 + 13;  // signature; IHDR
  Bytes out(png.begin(), png.begin() + kPixels);
  out.insert(out.end(), chunks.begin(), chunks.end());
  out.insert(out.end(), png.begin() + kPixels, png.end());
  return out;
}

// The JPEG with `count` comments of 16 bytes behind its first marker.
inline Bytes WithJpegComments(const Bytes& jpeg, int count) {
  constexpr uint8_t kCommentBytes = 16;
  Bytes out(jpeg.begin(), jpeg.begin() + 2);
  for (int i = 0; i < count; ++i) {
    out.insert(out.end(), {0xff, 0xfe, 0, kCommentBytes});
    out.resize(out.size() + kCommentBytes - 2);
  }
  out.insert(out.end(), jpeg.begin() + 2, jpeg.end());
  return out;
}

// A grey TIFF whose next directory, and those of EXIF, GPS and thumbnails, are its first one.
inline Bytes LoopedTiff(uint16_t side_px) {
  constexpr uint16_t kShort = 3, kLong = 4;
  struct Entry {
    uint16_t tag, type;
    uint32_t value;
  };
  constexpr uint32_t kFirst = 8, kNumEntries = 12;
  constexpr uint32_t kPixels = kFirst + 2 + 12 * kNumEntries + 4;
  const uint32_t num_pixels = uint32_t{side_px} * side_px;
  const Entry entries[kNumEntries] = {
      {256, kShort, side_px}, {257, kShort, side_px},  {258, kShort, 8},
      {259, kShort, 1},       {262, kShort, 1},        {273, kLong, kPixels},
      {277, kShort, 1},       {278, kShort, side_px},  {279, kLong, num_pixels},
      {330, kLong, kFirst},   {0x8769, kLong, kFirst}, {0x8825, kLong, kFirst}};
  Bytes out = {'M', 'M', 0, 42};
  AppendBigEndian(kFirst, &out);
  out.insert(out.end(), {0, kNumEntries});
  for (const Entry& entry : entries) {
    AppendBigEndian(uint32_t{entry.tag} << 16 | entry.type, &out);
    AppendBigEndian(1, &out);
    AppendBigEndian(entry.type == kShort ? entry.value << 16 : entry.value, &out);
  }
  AppendBigEndian(kFirst, &out);
  out.resize(out.size() + num_pixels, 7);
  return out;
}

}  // namespace skein
