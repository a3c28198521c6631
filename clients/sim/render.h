// Renders a photo of a place.
#pragma once

#include <cstdint>
#include <opencv2/core.hpp>

#include "clients/sim/camera.h"
#include "clients/sim/place.h"

namespace skein::sim {

// What a real camera adds.
struct Exposure {
  double gain = 1;           // exposure
  double vignetting = 0.12;  // loss of light in the corners
  double noise_sigma = 1.5;  // grey levels, in the dark; grows with the square root of light
  uint64_t seed = 1;         // of the noise
};

// BGR. Where one surface fills a pixel and its neighbours, its texture is averaged over 2 x 2
// band-limited samples. At edges 3 x 3 rays are cast.
cv::Mat3b RenderPhoto(const Place& place, const Camera& camera, const Pose& pose,
                      const Exposure& exposure);

}  // namespace skein::sim
