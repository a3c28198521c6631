#include "bundle/factor_kernels_body.h"

namespace skein {

FactorKernel Avx512FactorKernel() { return MakeKernel(); }

}  // namespace skein
