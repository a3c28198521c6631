#pragma once

#include <vector>

#include "sfm/camera.h"

namespace skein {

// Parameters of another camera model with which rays meet the photo where they do with `camera`, as
// nearly as that model can: least squares over a grid of pixels, by Levenberg-Marquardt. The
// principal point stays. Pixels that the camera has no ray for are left out.
std::vector<double> FitCameraModel(const Camera& camera, int model_id);

}  // namespace skein
