#pragma once

#include "base/image.h"
#include "bundle/bundle.h"

namespace skein {

// A pose in COLMAP's and in our form.
void GetPose(const colmap::Image& image, BundlePose* pose);
void SetPose(const BundlePose& pose, colmap::Image* image);

}  // namespace skein
