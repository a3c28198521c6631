// A picture of a model: coloured points and the cameras' frusta, from above and obliquely.
#pragma once

#include <opencv2/core.hpp>

#include "sfm/reconstruction.h"

namespace skein {

// BGR, 2 x `side_px` wide: the view from above, the oblique view. "Up" is the mean of the cameras'
// own. Cameras of a folder (an agent) share a colour. A model without photos gives an empty field.
cv::Mat3b DrawModel(const Reconstruction& model, int side_px);

}  // namespace skein
