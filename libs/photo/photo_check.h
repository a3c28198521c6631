#pragma once

#include <cstdint>
#include <string>

#include "core/bytes.h"
#include "core/result.h"
#include "photo/exif.h"
#include "photo/photo_header.h"

namespace skein {

struct PhotoLimits {
  int64_t max_bytes = int64_t{256} << 20;
  int64_t max_pixels = 100'000'000;  // checked before anything is decoded
  int64_t min_side_px = 64;

  Status Check() const;  // an error says which limit makes no sense
};

// A photo that passed.
struct CheckedPhoto {
  PhotoHeader header;
  Exif exif;
};

// Checks size, header and limits, then decodes fully. An error is the reason that the agent gets.
Result<CheckedPhoto> CheckPhoto(const Bytes& bytes, const PhotoLimits& limits);

struct FocalPrior {
  double focal_px = 0;
  bool from_exif = false;
};

// EXIF's focal length, else what the agent offered (0: nothing; absurd values too), else
// 1.2 * max(width, height).
FocalPrior ChooseFocal(const CheckedPhoto& photo, double offered_focal_px);

// Photos with one key share a camera: same agent, make, model, size as stored and focal prior. A
// zoom makes a new camera.
std::string CameraKey(const std::string& agent, const CheckedPhoto& photo, const FocalPrior& focal);

}  // namespace skein
