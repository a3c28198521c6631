#pragma once

#include <cstdint>
#include <optional>
#include <string>

namespace skein {

constexpr double kFullFrameDiagonalMm = 43.2666;  // 36 mm x 24 mm
constexpr double kHighestM = 100'000;             // an altitude that may be true, up or down

struct GpsPosition {
  double latitude_deg = 0;                    // WGS84
  double longitude_deg = 0;                   // WGS84
  std::optional<double> altitude_m;           // as the device reports it
  std::optional<double> relative_altitude_m;  // above the take-off, as a drone reports it
};

// EXIF orientations 2, 4, 5 and 7: the pixels as stored are a mirror image of the scene.
inline bool IsMirrored(int orientation) {
  return orientation == 2 || orientation == 4 || orientation == 5 || orientation == 7;
}

// The orientation that is left when the pixels as stored are flipped left to right if they are
// mirrored: 1, 3, 6 or 8. `orientation` 1..8; others count as 1.
inline int RotationOf(int orientation) {
  constexpr int kRotation[9] = {1, 1, 1, 3, 3, 8, 6, 6, 8};
  return orientation >= 1 && orientation <= 8 ? kRotation[orientation] : 1;
}

// Fields of a photo's EXIF; a field that is absent or absurd is left unset.
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
