#include "features/sift_kernels_body.h"

namespace skein {

SiftKernels Avx512SiftKernels() { return MakeKernels(); }

}  // namespace skein
