#include "depth/sweep_kernels.h"

#include <stdexcept>
#include <string>

namespace skein {

const SweepKernels& SweepKernelsOf(InstructionSet version) {
  if (!IsInstructionSetSupported(version)) {
    throw std::invalid_argument("this processor does not run the kernels of depth maps for " +
                                InstructionSetName(version));
  }
#if defined(__x86_64__)
  static const SweepKernels avx2 = Avx2SweepKernels(), avx512 = Avx512SweepKernels();
  if (version == InstructionSet::kAvx512) return avx512;
  if (version == InstructionSet::kAvx2) return avx2;
#endif
  static const SweepKernels portable = PortableSweepKernels();
  return portable;
}

}  // namespace skein
