#pragma once

#include <cstdint>
#include <opencv2/core.hpp>

#include "core/result.h"
#include "photo/byte_view.h"
#include "photo/photo_header.h"

namespace skein {

// Decodes a photo to 8-bit BGR with its pixels as stored: EXIF orientation is not applied, as in
// COLMAP. Grey, 16-bit and CMYK photos are converted. Error: not a photo, truncated, or more than
// `max_pixels` by its header.
Result<cv::Mat> DecodePhoto(ByteView bytes, int64_t max_pixels = 400'000'000);

// Of a photo with that header; both sides are divided by `reduction` (ReductionFor). Error: another
// size comes out.
Result<cv::Mat> DecodePhotoOf(const PhotoHeader& header, ByteView bytes, int reduction = 1);

// The same into `pixels`, room for 3 bytes a pixel: BGR, row major, without padding. No other
// thread of the process may use OpenCV meanwhile.
Status DecodePhotoInto(const PhotoHeader& header, ByteView bytes, int reduction, uint8_t* pixels);

}  // namespace skein
