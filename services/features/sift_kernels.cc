#include "features/sift_kernels.h"

#include <stdexcept>

namespace skein {

const SiftKernels& KernelsOf(InstructionSet version) {
  if (!IsInstructionSetSupported(version)) {
    throw std::invalid_argument("this processor does not run SIFT's kernels for " +
                                InstructionSetName(version));
  }
#if defined(__x86_64__)
  static const SiftKernels avx2 = Avx2SiftKernels(), avx512 = Avx512SiftKernels();
  if (version == InstructionSet::kAvx512) return avx512;
  if (version == InstructionSet::kAvx2) return avx2;
#endif
  static const SiftKernels portable = PortableSiftKernels();
  return portable;
}

}  // namespace skein
