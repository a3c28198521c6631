#include "depth/sweep_kernels_body.h"

namespace skein {

SweepKernels Avx2SweepKernels() { return MakeKernels(); }

}  // namespace skein
