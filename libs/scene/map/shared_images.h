// A model's registered images with the 3D points of their keypoints: what a mapper tells the merger
// (formats/formats.h: SharedImages).
#pragma once

#include <cstdint>
#include <vector>

#include "formats/formats.h"
#include "sfm/reconstruction.h"

namespace skein {

// Photos among `image_ids` that are registered in the model, with every keypoint that has a 3D
// point.
SharedImages SharedImagesOf(const Reconstruction& model, const std::vector<int64_t>& image_ids);

}  // namespace skein
