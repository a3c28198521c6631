#include "depth/sweep_kernels.h"

namespace skein {

const SweepKernels& SweepKernelsOf(InstructionSet version) {
  RequireInstructionSet(version, "the kernels of depth maps");
#if defined(__x86_64__)
  static const SweepKernels avx2 = Avx2SweepKernels(), avx512 = Avx512SweepKernels();
  if (version == InstructionSet::kAvx512) return avx512;
  if (version == InstructionSet::kAvx2) return avx2;
#endif
  static const SweepKernels portable = PortableSweepKernels();
  return portable;
}

}  // namespace skein
