#pragma once

#include <cstdint>
#include <opencv2/imgcodecs.hpp>
#include <stdexcept>
#include <string>
#include <vector>

#include "core/bytes.h"

// Small photos, made on the fly, for tests.
namespace skein {

// Noise, so that two seeds make two contents. BGR, or grey for one channel.
inline cv::Mat Noise(int width, int height, int type = CV_8UC3, uint64_t seed = 1) {
  cv::Mat image(height, width, type);
  cv::RNG rng(seed);
  rng.fill(image, cv::RNG::UNIFORM, 0, CV_MAT_DEPTH(type) == CV_16U ? 65536 : 256);
  return image;
}

inline Bytes Encode(const cv::Mat& image, const std::string& extension) {
  Bytes bytes;
  cv::imencode(extension, image, bytes);
  return bytes;
}

inline Bytes SmallJpeg(uint64_t seed = 1, int width = 96, int height = 80) {
  return Encode(Noise(width, height, CV_8UC3, seed), ".jpg");
}

// Writes the claimed size into a JPEG's frame header.
inline Bytes WithClaimedSize(Bytes jpeg, uint16_t width, uint16_t height) {
  for (size_t at = 2; at + 9 < jpeg.size(); at += 2 + (jpeg[at + 2] << 8 | jpeg[at + 3])) {
    if (jpeg[at + 1] != 0xc0) continue;
    jpeg[at + 5] = static_cast<uint8_t>(height >> 8);
    jpeg[at + 6] = static_cast<uint8_t>(height);
    jpeg[at + 7] = static_cast<uint8_t>(width >> 8);
    jpeg[at + 8] = static_cast<uint8_t>(width);
    return jpeg;
  }
  throw std::logic_error("no baseline frame");
}

// An EXIF block as a JPEG's APP1 segment holds it, built entry by entry (big endian).
class ExifBuilder {
 public:
  void Ascii(int ifd, uint16_t tag, const std::string& text) {
    Add(ifd, tag, 2, static_cast<uint32_t>(text.size() + 1),
        Bytes(text.c_str(), text.c_str() + text.size() + 1));
  }
  void Short(int ifd, uint16_t tag, uint16_t value) {
    Add(ifd, tag, 3, 1, {static_cast<uint8_t>(value >> 8), static_cast<uint8_t>(value), 0, 0});
  }
  void Byte(int ifd, uint16_t tag, uint8_t value) { Add(ifd, tag, 1, 1, {value, 0, 0, 0}); }
  void Rationals(int ifd, uint16_t tag, const std::vector<std::pair<uint32_t, uint32_t>>& values) {
    Bytes data;
    for (const auto& [numerator, denominator] : values) {
      Put32(&data, numerator);
      Put32(&data, denominator);
    }
    Add(ifd, tag, 5, static_cast<uint32_t>(values.size()), data);
  }

  // ifd numbers: 0 main, 1 EXIF, 2 GPS.
  Bytes Tiff() const {
    Bytes out = {'M', 'M', 0, 42, 0, 0, 0, 8};
    uint32_t begin[3];
    const size_t counts[3] = {entries_[0].size() + 2, entries_[1].size(), entries_[2].size()};
    begin[0] = 8;
    for (int i = 1; i < 3; ++i)
      begin[i] = begin[i - 1] + static_cast<uint32_t>(6 + 12 * counts[i - 1]);
    uint32_t data_at = begin[2] + static_cast<uint32_t>(6 + 12 * counts[2]);
    Bytes data;
    for (int ifd = 0; ifd < 3; ++ifd) {
      Put16(&out, static_cast<uint16_t>(counts[ifd]));
      for (const Entry& entry : entries_[ifd]) PutEntry(&out, entry, data_at, &data);
      if (ifd == 0) {
        PutPointer(&out, 0x8769, begin[1]);
        PutPointer(&out, 0x8825, begin[2]);
      }
      Put32(&out, 0);
    }
    out.insert(out.end(), data.begin(), data.end());
    return out;
  }

  // The JPEG with the block put right after its start.
  Bytes Into(const Bytes& jpeg) const {
    const Bytes tiff = Tiff();
    Bytes out(jpeg.begin(), jpeg.begin() + 2);
    out.insert(out.end(), {0xff, 0xe1});
    Put16(&out, static_cast<uint16_t>(8 + tiff.size()));
    out.insert(out.end(), {'E', 'x', 'i', 'f', 0, 0});
    out.insert(out.end(), tiff.begin(), tiff.end());
    out.insert(out.end(), jpeg.begin() + 2, jpeg.end());
    return out;
  }

 private:
  struct Entry {
    uint16_t tag, type;
    uint32_t count;
    Bytes data;  // of 4 bytes: lies in the entry
  };

  static void Put16(Bytes* out, uint16_t value) {
    out->insert(out->end(), {static_cast<uint8_t>(value >> 8), static_cast<uint8_t>(value)});
  }
  static void Put32(Bytes* out, uint32_t value) {
    Put16(out, static_cast<uint16_t>(value >> 16));
    Put16(out, static_cast<uint16_t>(value));
  }
  static void PutPointer(Bytes* out, uint16_t tag, uint32_t offset) {
    Put16(out, tag);
    Put16(out, 4);
    Put32(out, 1);
    Put32(out, offset);
  }
  static void PutEntry(Bytes* out, const Entry& entry, uint32_t data_at, Bytes* data) {
    Put16(out, entry.tag);
    Put16(out, entry.type);
    Put32(out, entry.count);
    if (entry.data.size() == 4) {
      out->insert(out->end(), entry.data.begin(), entry.data.end());
    } else {
      Put32(out, data_at + static_cast<uint32_t>(data->size()));
      data->insert(data->end(), entry.data.begin(), entry.data.end());
    }
  }
  void Add(int ifd, uint16_t tag, uint16_t type, uint32_t count, Bytes data) {
    while (data.size() < 4) data.push_back(0);
    entries_[ifd].push_back({tag, type, count, std::move(data)});
  }

  std::vector<Entry> entries_[3];
};

}  // namespace skein
