#include "bundle/factor_kernels.h"

namespace skein {

FactorKernel FactorKernelOf(InstructionSet version) {
  RequireInstructionSet(version, "the kernel of the Schur complement");
#if defined(__x86_64__)
  if (version == InstructionSet::kAvx512) return Avx512FactorKernel();
  if (version == InstructionSet::kAvx2) return Avx2FactorKernel();
#endif
  return PortableFactorKernel();
}

}  // namespace skein
