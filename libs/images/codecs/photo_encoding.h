// A photo as a camera would store it: JPEG with EXIF.
#pragma once

#include <cstdint>
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <vector>

#include "photo/exif.h"

namespace skein {

constexpr int kJpegQuality = 95;  // of photos that the clients write: OpenCV's default

// Fields that are 0 are left out.
struct ExifInfo {
  std::string make, model;
  int64_t capture_utime_us = 0;  // UTC
  double focal_mm = 0;
  int focal_35mm = 0;  // focal length in pixels * 36 mm / longer side, rounded as cameras do
  int width = 0, height = 0;
  int orientation = 1;             // 1..8
  std::optional<GpsPosition> gps;  // its relative altitude is left out: EXIF has no tag for it
};

// The APP1 segment's payload: "Exif\0\0" and a little-endian TIFF structure.
std::vector<uint8_t> EncodeExif(const ExifInfo& info);

// The JPEG with `exif`, an APP1 segment's payload, behind its start. Throws where it has more than
// the 65,533 bytes of a segment.
std::vector<uint8_t> WithExif(std::vector<uint8_t> jpeg, const std::vector<uint8_t>& exif);

// JPEG bytes; `exif` null: none. Throws when OpenCV cannot encode.
std::vector<uint8_t> EncodePhoto(const cv::Mat3b& image, const ExifInfo* exif, int quality);

}  // namespace skein
