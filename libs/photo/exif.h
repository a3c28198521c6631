#pragma once

#include <cstdint>
#include <optional>
#include <string>

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
  bool focal_is_guess = false;     // the fields leave open what focal_px is
  double digital_zoom = 1;         // DigitalZoomRatio; 1: none, or not told
  int64_t capture_utime_us = 0;    // UTC where the offset is given, else local time read as UTC
  std::optional<GpsPosition> gps;
};

}  // namespace skein
