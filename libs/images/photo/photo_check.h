#pragma once

#include <cstdint>
#include <string>

#include "core/result.h"
#include "photo/byte_view.h"
#include "photo/exif.h"
#include "photo/photo_header.h"

namespace skein {

// Limits of OpenCV's decoders.
constexpr int64_t kMaxPhotoBytes = (int64_t{1} << 31) - 1;
constexpr int64_t kMaxPhotoPixels = int64_t{1} << 30;

// Time to decode grows with the number of scans, of which a few bytes make one ("Two Issues with
// the JPEG Standard", libjpeg-turbo.org, which advises a limit). libtiff and GDAL have this one
// (LIBTIFF_JPEG_MAX_ALLOWED_SCAN_NUMBER). libjpeg's own progression has 10 scans.
constexpr int kMaxJpegScans = 100;

// libpng inflates each compressed text to 8 MB at most (PNG_USER_CHUNK_MALLOC_MAX), and takes 1,000
// of them (PNG_USER_CHUNK_CACHE_MAX): such a file has 8 MB, and takes 46 s whatever its pixels. A
// photo has a profile and a text for each of XMP, EXIF and IPTC.
constexpr int kMaxPngTexts = 32;

struct PhotoLimits {
  int64_t max_bytes = int64_t{256} << 20;
  int64_t max_pixels = 100'000'000;  // checked before anything is decoded
  int64_t min_side_px = 64;

  Status Check() const;  // an error says which limit makes no sense
};

// A photo that decodes, within the limits.
struct CheckedPhoto {
  PhotoHeader header;
  Exif exif;
};

// Checks the size of the file, what it is, the limits, the number of a JPEG's scans and of a PNG's
// texts: all before anything is decoded. An error is the reason that the agent gets.
Result<PhotoHeader> CheckHeader(ByteView bytes, const PhotoLimits& limits);

// Kinds of refusals that a photographer can do something about. The numbers are failure_t's.
enum class PhotoFault {
  kOther = 0,
  kUnreadable = 1,   // damaged, or no JPEG, PNG or TIFF
  kPhoneFormat = 2,  // HEIC or AVIF
  kTooSmall = 3,
  kTooLarge = 4,
};

// Kind of the error that CheckHeader or PhotoDecoder::Check gave for `bytes`.
PhotoFault FaultOf(StatusCode error, ByteView bytes);

struct FocalPrior {
  double focal_px = 0;
  bool from_exif = false;
};

// EXIF's focal length, else what the agent offered (0: nothing; absurd values too), else
// 1.2 * max(width, height). `from_exif` is false where EXIF leaves it open.
FocalPrior ChooseFocal(const CheckedPhoto& photo, double offered_focal_px);

// Photos with one key share a camera: same agent, make, model, size as stored, focal prior and
// digital zoom.
std::string CameraKey(const std::string& agent, const CheckedPhoto& photo, const FocalPrior& focal);

}  // namespace skein
