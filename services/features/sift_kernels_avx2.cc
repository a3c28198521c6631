#include "features/sift_kernels_body.h"

namespace skein {

SiftKernels Avx2SiftKernels() { return MakeKernels(); }

}  // namespace skein
