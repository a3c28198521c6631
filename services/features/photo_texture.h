// Finds the texture of a photo that dense matching could use.
#pragma once

#include <opencv2/core.hpp>

#include "formats/texture_fields.h"

namespace skein {

// A window of 7 x 7 pixels has texture if its grey levels, 0 to 255, deviate by 2. If texture of
// deviation s has noise n, two photos match with an expected ZNCC of s^2 / (s^2 + n^2). The sum is
// what is measured. With the 1.2 levels of a small sensor's noise 2 levels make 0.64; dense
// matching asks for 0.6 (benchmark/support/plane_sweep.h). A field has texture where half of its
// windows have. The photo is shrunk to a longest side of 1600 pixels, as for SIFT. About 3 ms.
TextureFields FindTexture(const cv::Mat& bgr_or_grey);

}  // namespace skein
