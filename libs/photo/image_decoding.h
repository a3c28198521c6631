#pragma once

#include <cstdint>
#include <opencv2/core.hpp>

#include "core/bytes.h"
#include "core/result.h"

namespace skein {

// Decodes a photo to 8-bit BGR with its pixels as stored: EXIF orientation is not applied, as in
// COLMAP. Grey, 16-bit and CMYK photos are converted. Error: not a photo, truncated, or more than
// `max_pixels`. The header's size must have been checked before (ingest does): OpenCV allocates
// what the header claims.
Result<cv::Mat> DecodePhoto(const Bytes& bytes, int64_t max_pixels = 400'000'000);

// Turns pixels as stored to the upright view. `exif_orientation` 1..8; others count as 1.
cv::Mat UprightView(const cv::Mat& as_stored, int exif_orientation);

// Shrinks (never enlarges) so that the longest side is at most `max_side_px`.
cv::Mat ShrinkTo(const cv::Mat& image, int max_side_px);

// A JPEG of the upright view, at most `max_side_px` on its longest side, of a photo of that size.
// Decodes a JPEG photo at a fraction of its resolution.
Result<Bytes> MakeThumbnail(const Bytes& photo, int width_px, int height_px, int exif_orientation,
                            int max_side_px);

}  // namespace skein
