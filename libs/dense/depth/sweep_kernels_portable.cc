#include "depth/sweep_kernels_body.h"

namespace skein {

SweepKernels PortableSweepKernels() { return MakeKernels(); }

}  // namespace skein
