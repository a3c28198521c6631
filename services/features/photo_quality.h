// Figures of a photo's pixels that tell its worth for a map, whatever it shows.
#pragma once

#include <opencv2/core.hpp>
#include <vector>

#include "formats/formats.h"
#include "formats/texture_fields.h"

namespace skein {

struct PhotoQuality {
  // How little of the change from pixel to pixel is lost when the photo is blurred once more: 0
  // sharp, 1 blurred. The greater of both axes, so that the motion of a camera counts. Crete et
  // al., The Blur Effect, 2007, at a longest side of 400 pixels, where an edge stands out of the
  // noise. 0 without any edge.
  float blur = 0;
  float brightness = 0;  // mean grey level, 0 to 1
  float coverage = 0;    // share of 8 x 8 fields of the photo that hold a keypoint
  TextureFields texture;
};

// `bgr`: 8 bits, as decoded, both sides divided by `reduction`; keypoints in pixels of the full
// resolution. About 8 ms.
PhotoQuality MeasureQuality(const cv::Mat& bgr, const std::vector<Keypoint>& keypoints,
                            int reduction = 1);

}  // namespace skein
