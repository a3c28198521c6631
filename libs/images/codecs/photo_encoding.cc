#include "codecs/photo_encoding.h"

#include <cmath>
#include <cstdio>
#include <ctime>
#include <opencv2/imgcodecs.hpp>
#include <stdexcept>
#include <utility>

namespace skein {
namespace {

using Bytes = std::vector<uint8_t>;

enum Type : uint16_t { kByte = 1, kAscii = 2, kShort = 3, kLong = 4, kRational = 5 };

void Put(uint64_t value, int bytes, Bytes* out) {
  const size_t at = out->size();
  out->resize(at + bytes);
  for (int i = 0; i < bytes; ++i) (*out)[at + i] = static_cast<uint8_t>(value >> (8 * i));
}

struct Entry {
  uint16_t tag;
  Type type;
  uint32_t count;
  Bytes value;
};

Entry Ascii(uint16_t tag, const std::string& text) {
  Bytes value(text.begin(), text.end());
  value.push_back(0);
  return {tag, kAscii, static_cast<uint32_t>(value.size()), value};
}

Entry Short(uint16_t tag, uint16_t number) {
  Bytes value;
  Put(number, 2, &value);
  return {tag, kShort, 1, value};
}

Entry Long(uint16_t tag, uint32_t number) {
  Bytes value;
  Put(number, 4, &value);
  return {tag, kLong, 1, value};
}

Entry Rationals(uint16_t tag, const std::vector<std::pair<double, uint32_t>>& numbers) {
  Bytes value;
  for (const auto& [number, denominator] : numbers) {
    Put(static_cast<uint32_t>(std::llround(number * denominator)), 4, &value);
    Put(denominator, 4, &value);
  }
  return {tag, kRational, static_cast<uint32_t>(numbers.size()), value};
}

// An image file directory at `offset`: its entries, sorted by tag, then their longer values.
Bytes EncodeDirectory(const std::vector<Entry>& entries, uint32_t offset) {
  Bytes directory, values;
  const uint32_t values_at = offset + 2 + 12 * static_cast<uint32_t>(entries.size()) + 4;
  Put(entries.size(), 2, &directory);
  for (const Entry& entry : entries) {
    Put(entry.tag, 2, &directory);
    Put(entry.type, 2, &directory);
    Put(entry.count, 4, &directory);
    Bytes field = entry.value;
    if (field.size() > 4) {
      field.clear();
      Put(values_at + values.size(), 4, &field);
      values.insert(values.end(), entry.value.begin(), entry.value.end());
      if (values.size() % 2) values.push_back(0);
    }
    field.resize(4);
    directory.insert(directory.end(), field.begin(), field.end());
  }
  Put(0, 4, &directory);  // no next directory
  directory.insert(directory.end(), values.begin(), values.end());
  return directory;
}

std::string ExifTime(int64_t utime_us) {
  const std::time_t seconds = utime_us / 1000000;
  std::tm tm{};
  gmtime_r(&seconds, &tm);
  char text[32];
  std::strftime(text, sizeof text, "%Y:%m:%d %H:%M:%S", &tm);
  return text;
}

std::string Subsecond(int64_t utime_us) {
  char text[8];
  std::snprintf(text, sizeof text, "%03d", static_cast<int>(utime_us / 1000 % 1000));
  return text;
}

std::vector<Entry> GpsEntries(const GpsPosition& gps) {
  const auto angle = [](uint16_t tag, double degrees) {
    const double whole = std::floor(std::abs(degrees));
    const double minutes = (std::abs(degrees) - whole) * 60;
    const double seconds = (minutes - std::floor(minutes)) * 60;
    return Rationals(tag, {{whole, 1}, {std::floor(minutes), 1}, {seconds, 1000000}});
  };
  std::vector<Entry> entries = {
      Entry{0, kByte, 4, {2, 3, 0, 0}}, Ascii(1, gps.latitude_deg >= 0 ? "N" : "S"),
      angle(2, gps.latitude_deg), Ascii(3, gps.longitude_deg >= 0 ? "E" : "W"),
      angle(4, gps.longitude_deg)};
  if (gps.altitude_m) {
    entries.push_back({5, kByte, 1, {static_cast<uint8_t>(*gps.altitude_m < 0)}});
    entries.push_back(Rationals(6, {{std::abs(*gps.altitude_m), 1000}}));
  }
  return entries;
}

}  // namespace

Bytes EncodeExif(const ExifInfo& info) {
  std::vector<Entry> image = {Ascii(0x010f, info.make), Ascii(0x0110, info.model),
                              Short(0x0112, static_cast<uint16_t>(info.orientation))};
  std::vector<Entry> photo;
  const bool has_time = info.capture_utime_us != 0;
  if (has_time) image.push_back(Ascii(0x0132, ExifTime(info.capture_utime_us)));
  if (has_time) photo.push_back(Ascii(0x9003, ExifTime(info.capture_utime_us)));
  if (info.focal_mm > 0) photo.push_back(Rationals(0x920a, {{info.focal_mm, 1000}}));
  if (has_time) photo.push_back(Ascii(0x9291, Subsecond(info.capture_utime_us)));
  photo.push_back(Long(0xa002, info.width));
  photo.push_back(Long(0xa003, info.height));
  if (info.focal_35mm > 0) photo.push_back(Short(0xa405, info.focal_35mm));
  const size_t photo_link = image.size();
  image.push_back(Long(0x8769, 0));
  if (info.gps) image.push_back(Long(0x8825, 0));
  constexpr uint32_t kHeader = 8;
  const uint32_t photo_at = kHeader + EncodeDirectory(image, kHeader).size();
  const Bytes photo_directory = EncodeDirectory(photo, photo_at);
  const uint32_t gps_at = photo_at + photo_directory.size();
  image[photo_link] = Long(0x8769, photo_at);
  if (info.gps) image[photo_link + 1] = Long(0x8825, gps_at);

  Bytes exif = {'E', 'x', 'i', 'f', 0, 0, 'I', 'I', 42, 0, kHeader, 0, 0, 0};
  const auto append = [&](const Bytes& part) { exif.insert(exif.end(), part.begin(), part.end()); };
  append(EncodeDirectory(image, kHeader));
  append(photo_directory);
  if (info.gps) append(EncodeDirectory(GpsEntries(*info.gps), gps_at));
  return exif;
}

Bytes WithExif(Bytes jpeg, const Bytes& exif) {
  const size_t length = exif.size() + 2;
  if (length > 0xffff) throw std::runtime_error("the EXIF block is too long for a JPEG");
  Bytes segment = {0xff, 0xe1, static_cast<uint8_t>(length >> 8), static_cast<uint8_t>(length)};
  segment.insert(segment.end(), exif.begin(), exif.end());
  jpeg.insert(jpeg.begin() + 2, segment.begin(), segment.end());  // after the start-of-image marker
  return jpeg;
}

Bytes EncodePhoto(const cv::Mat3b& image, const ExifInfo* exif, int quality) {
  Bytes jpeg;
  if (!cv::imencode(".jpg", image, jpeg, {cv::IMWRITE_JPEG_QUALITY, quality})) {
    throw std::runtime_error("OpenCV could not encode a JPEG");
  }
  return exif == nullptr ? jpeg : WithExif(std::move(jpeg), EncodeExif(*exif));
}

}  // namespace skein
