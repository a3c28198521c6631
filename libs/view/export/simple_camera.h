#pragma once

#include "core/result.h"
#include "sfm/camera.h"

namespace skein {

// Whether NVM or Bundler ("nvm", "bundler") can hold the camera: one focal length, the principal
// point in the middle of the photo, as their readers take it to be, and one radial parameter, in
// Bundler's format also two. The error says what is in the way.
Status ExpectSimpleCamera(const Camera& camera, const std::string& format);

}  // namespace skein
