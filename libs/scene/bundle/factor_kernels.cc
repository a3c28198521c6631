#include "bundle/factor_kernels.h"

#include <stdexcept>

namespace skein {

FactorKernel FactorKernelOf(InstructionSet version) {
  if (!IsInstructionSetSupported(version)) {
    throw std::invalid_argument("this processor does not run the kernel of Cholesky for " +
                                InstructionSetName(version));
  }
#if defined(__x86_64__)
  if (version == InstructionSet::kAvx512) return Avx512FactorKernel();
  if (version == InstructionSet::kAvx2) return Avx2FactorKernel();
#endif
  return PortableFactorKernel();
}

}  // namespace skein
