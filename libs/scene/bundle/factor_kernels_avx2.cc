#include "bundle/factor_kernels_body.h"

namespace skein {

FactorKernel Avx2FactorKernel() { return MakeKernel(); }

}  // namespace skein
