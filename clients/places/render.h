// Renders a photo of a place.
#pragma once

#include <opencv2/core.hpp>

#include "clients/places/camera.h"
#include "clients/places/effects.h"
#include "clients/places/place.h"

namespace skein::sim {

// A camera at the middle of a photo's exposure, and how it moves during it.
struct View {
  Pose pose;
  Motion motion;
  Shutter shutter;
};

// The light that reaches the sensor, BGR, 255 at white. Each row is seen from where the camera is
// at the row's time, and is blurred along the image motion of the row's exposure. If one surface
// fills a pixel and its neighbours, its texture is averaged over 2 x 2 band-limited samples. At
// edges 3 x 3 rays are cast.
cv::Mat3f RenderLight(const Place& place, const Camera& camera, const View& view);

// BGR, of a camera at rest.
cv::Mat3b RenderPhoto(const Place& place, const Camera& camera, const Pose& pose,
                      const Exposure& exposure);

}  // namespace skein::sim
