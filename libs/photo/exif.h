#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "core/bytes.h"
#include "photo/photo_header.h"

namespace skein {

struct GpsPosition {
  double latitude_deg = 0;   // WGS84
  double longitude_deg = 0;  // WGS84
  double altitude_m = 0;     // as the device reports it, 0 if it doesn't
};

// What EXIF says; what is absent or absurd is left unset.
struct Exif {
  int orientation = 1;  // 1..8
  std::string make;
  std::string model;
  std::optional<double> focal_px;  // for the stored size
  int64_t capture_utime_us = 0;    // UTC where the offset is given, else local time read as UTC
  std::optional<GpsPosition> gps;
};

// Reads the EXIF block of a JPEG (APP1), PNG (eXIf) or TIFF. Without one, everything is unset.
//
// Focal length in pixels, the first that is there:
//  - FocalLengthIn35mmFilm by the diagonal (CIPA DCG-001): f35 * diagonal / 43.27 mm. This equals
//    f35 * width / 36 for a 3:2 sensor. For 4:3 it is closer (south-building: 1,294 px, by width
//    1,244, calibrated 1,333).
//  - FocalLength with FocalPlaneXResolution, for the width by PixelXDimension.
//  - FocalLength with the sensor's width from COLMAP's camera database.
Exif ReadExif(const Bytes& bytes, const PhotoHeader& header);

}  // namespace skein
