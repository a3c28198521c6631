#pragma once

#include <cstdint>
#include <opencv2/core.hpp>

#include "core/result.h"
#include "photo/byte_view.h"
#include "photo/photo_header.h"

namespace skein {

// Decodes a photo to 8-bit BGR. EXIF's rotation is not applied, as in COLMAP. A mirrored photo
// (IsMirrored) is flipped left to right, so that it shows the scene by a rigid camera: column x of
// the result is column width - 1 - x as stored. Grey and CMYK photos are converted. 16-bit photos
// keep the upper 8 bits; if the photo's values span less than half of them, and for 32-bit samples,
// their range becomes 0 to 255 (deep_pixels.h). Error: not a photo, truncated, or more than
// `max_pixels` by its header.
Result<cv::Mat> DecodePhoto(ByteView bytes, int64_t max_pixels = 400'000'000);

// Decodes a photo with that header; both sides are divided by `reduction` (ReductionFor). Error:
// another size comes out.
Result<cv::Mat> DecodePhotoOf(const PhotoHeader& header, ByteView bytes, int reduction = 1);

// The same into `pixels`, room for 3 bytes a pixel: BGR, row major, without padding. No other
// thread of the process may use OpenCV meanwhile.
Status DecodePhotoInto(const PhotoHeader& header, ByteView bytes, int reduction, uint8_t* pixels);

}  // namespace skein
