#include "features/sift_kernels.h"

namespace skein {

const SiftKernels& KernelsOf(InstructionSet version) {
  RequireInstructionSet(version, "SIFT's kernels");
#if defined(__x86_64__)
  static const SiftKernels avx2 = Avx2SiftKernels(), avx512 = Avx512SiftKernels();
  if (version == InstructionSet::kAvx512) return avx512;
  if (version == InstructionSet::kAvx2) return avx2;
#endif
  static const SiftKernels portable = PortableSiftKernels();
  return portable;
}

}  // namespace skein
