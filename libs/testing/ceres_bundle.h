// The problem of bundle/bundle.h, minimised by Ceres: tests and benchmarks hold Skein's own bundle
// adjustment against it.
#pragma once

#include "bundle/bundle.h"

namespace skein {

// The defaults, all but the loss, are those of COLMAP 3.8 (optim/bundle_adjustment.h).
struct CeresOptions {
  int max_iterations = 100;
  double function_tolerance = 0;   // relative decrease of the cost
  double gradient_tolerance = 0;   // largest component of the gradient
  double parameter_tolerance = 0;  // relative length of the step
  int max_linear_iterations = 200;
  double loss_scale_px = 1.0;  // of the soft L1 loss
  int num_threads = 1;
};

struct CeresSummary {
  bool usable = false;
  int iterations = 0;     // linear systems solved
  double final_cost = 0;  // as BundleSummary's, but for points behind a camera
};

// Residuals, parameters and linear solver as in COLMAP 3.8: automatic differentiation, quaternions;
// a dense Schur complement up to 50 poses, a sparse one up to 1,000, conjugate gradients beyond. If
// no pose is held, the first one and the second one's x are, as in COLMAP. Weak priors of cameras
// count, stiffness of poses does not. Throws std::invalid_argument for a camera model other than
// SIMPLE_PINHOLE, PINHOLE, SIMPLE_RADIAL, RADIAL and OPENCV.
CeresSummary SolveByCeres(const CeresOptions& options, Bundle* bundle);

}  // namespace skein
