// Bundle adjustment of a part of a model, for the seam of a merge: the whole of a small model, of a
// large one the images around the seam.
#pragma once

#include <set>

#include "base/reconstruction.h"
#include "bundle/bundle.h"

namespace skein {

struct SeamOptions {
  int max_iterations = 30;
  double function_tolerance = 1e-5;
  int num_threads = 1;
  double loss_scale_px = 1.0;  // soft L1
  // A camera with fewer photos among the free images keeps its intrinsics, and so does one with a
  // photo outside of them: a window alone never decides about a shared camera.
  int min_images_for_intrinsics = 6;
};

// Refines poses of `free_images`, all points they see, and intrinsics as told above. Other images
// that see those points hold the frame; where there are none, it moves as little as it must. All of
// `free_images` must be registered.
BundleSummary AdjustSeam(const std::set<colmap::image_t>& free_images, const SeamOptions& options,
                         colmap::Reconstruction* model);

}  // namespace skein
