#include "features/sift_kernels_body.h"

namespace skein {

SiftKernels PortableSiftKernels() { return MakeKernels(); }

}  // namespace skein
