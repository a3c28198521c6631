#pragma once

#include "sfm/camera.h"

namespace skein {

// The camera with another model, with which rays meet the photo where they do with `camera`, as
// nearly as the model can: least squares over a grid of pixels, by Levenberg-Marquardt. The
// principal point stays. Pixels that the camera has no ray for are left out.
Camera FitCameraModel(const Camera& camera, int model_id);

}  // namespace skein
