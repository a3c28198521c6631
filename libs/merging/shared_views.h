// Shared photos as they travel between a mapper and the merger (formats/formats.h: SharedImages).
#pragma once

#include <cstdint>
#include <vector>

#include "base/reconstruction.h"
#include "formats/formats.h"
#include "geometry/sim3_ransac.h"

namespace skein {

// Those of `image_ids` that are registered in the model, with every keypoint that has a 3D point.
SharedImages DescribeShared(const colmap::Reconstruction& model,
                            const std::vector<int64_t>& image_ids);

// The same for EstimateSim3. Images of an unknown camera model or with wrong parameters are left
// out: the blob came over the network.
std::vector<SharedView> ViewsOf(const SharedImages& images);

}  // namespace skein
