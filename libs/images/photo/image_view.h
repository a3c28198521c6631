#pragma once

#include <opencv2/core.hpp>

namespace skein {

// Turns a decoded photo, which is unmirrored (codecs/image_decoding.h), to the upright view.
// `exif_orientation` 1..8; others count as 1.
cv::Mat UprightView(const cv::Mat& decoded, int exif_orientation);

// Shrinks (never enlarges) so that the longest side is at most `max_side_px`.
cv::Mat ShrinkTo(const cv::Mat& image, int max_side_px);

}  // namespace skein
