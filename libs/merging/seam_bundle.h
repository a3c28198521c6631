// Bundle adjustment of a part of a model, for the seam of a merge: the whole of a small model, of a
// large one the images around the seam.
#pragma once

#include <set>

#include "base/reconstruction.h"
#include "bundle/bundle.h"

namespace skein {

// Refines poses of `free_images`, all points they see, and intrinsics. Other images that see those
// points hold the frame; where there are none, it moves as little as it must. A camera keeps its
// intrinsics that has fewer photos among the free images than `min_images_for_intrinsics`, or one
// outside of them: a window alone never decides about a shared camera. All of `free_images` must be
// registered. Loss: soft L1 at 1 px.
BundleSummary AdjustSeam(const std::set<colmap::image_t>& free_images,
                         int min_images_for_intrinsics, colmap::Reconstruction* model);

}  // namespace skein
