#include "depth/sweep_kernels_body.h"

namespace skein {

SweepKernels Avx512SweepKernels() { return MakeKernels(); }

}  // namespace skein
