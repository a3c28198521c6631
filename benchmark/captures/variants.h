// Photos as other cameras, weather and apps would have made them. Each function keeps its input.
#pragma once

#include <cstdint>
#include <opencv2/core.hpp>
#include <vector>

#include "core/bytes.h"

namespace skein {

cv::Mat3b Half(const cv::Mat3b& photo);

// The exposure times `factor`. Light is (value / 255)^2.2, sRGB's curve but for its darkest part.
cv::Mat3b Exposed(const cv::Mat3b& photo, double factor);

// As through fog or water, where all surfaces are equally far (Koschmieder):
//   value * transmission + kVeil * (1 - transmission) + noise of a standard deviation of 1
cv::Mat3b Hazy(const cv::Mat3b& photo, double transmission, uint64_t seed);

// The middle 1/zoom of the photo, as large as the photo. zoom >= 1.
cv::Mat3b Zoomed(const cv::Mat3b& photo, double zoom);

// The text that recorders burn in, at one place in all photos: two blocks, 4 % of the photo's area.
cv::Mat3b Overlaid(const cv::Mat3b& photo);

// A turn of the camera about its centre, first to the right, then down, then clockwise about the
// view.
struct Turn {
  double yaw_rad = 0, pitch_rad = 0, roll_rad = 0;
};

// View of the camera after `turn`, of `size`, with the same focal length: the photo by the
// homography K' R K^-1 of a lens without distortion. Outside the photo its border is repeated.
cv::Mat3b Turned(const cv::Mat3b& photo, double focal_px, const Turn& turn, cv::Size size);

// Turns of a tripod's head, two sweeps, such that each view of half the photo's sides lies in the
// photo.
std::vector<Turn> Sweep(cv::Size photo, double focal_px, int num_turns);

// The photo once more from the same place, a moment later: a tremble of 0.1 to 0.3 degrees and
// other noise.
cv::Mat3b BurstShot(const cv::Mat3b& photo, double focal_px, uint64_t seed);

// Pixels as a camera stores them that writes this EXIF orientation, 1..8, beside them.
cv::Mat3b StoredAs(const cv::Mat3b& upright, int exif_orientation);

// The payload of a JPEG's EXIF segment; empty without one, and of other files.
Bytes ExifOf(const Bytes& photo);

}  // namespace skein
