#include "bundle/factor_kernels_body.h"

namespace skein {

FactorKernel PortableFactorKernel() { return MakeKernel(); }

}  // namespace skein
