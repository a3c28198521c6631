// Bundle adjustment of a part of a model, for the seam of a merge. Ceres on COLMAP 3.8's cost
// functions; the whole of a small model is adjusted, of a large one the images around the seam.
#pragma once

#include <set>

#include "base/reconstruction.h"

namespace skein {

struct SeamOptions {
  int max_iterations = 30;
  int num_threads = 1;
  double loss_scale_px = 1.0;  // soft L1
  // A camera with fewer photos among the free images keeps its intrinsics, and so does one with a
  // photo outside of them: a window alone never decides about a shared camera.
  int min_images_for_intrinsics = 6;
};

struct SeamSummary {
  bool usable = false;
  int num_residuals = 0;
  int num_free_images = 0;
  double initial_cost = 0.0;
  double final_cost = 0.0;
};

// Refines poses of `free_images`, all points they see, and intrinsics as told above. Other images
// that see those points hold the frame; where there are none, one free image and the largest
// component of another's translation are held. All of `free_images` must be registered.
SeamSummary AdjustSeam(const std::set<colmap::image_t>& free_images, const SeamOptions& options,
                       colmap::Reconstruction* model);

}  // namespace skein
