#include "depth/sweep_kernels.h"

#include <algorithm>
#include <stdexcept>

namespace skein {

std::string SweepKernelName(SweepKernelVersion version) {
  switch (version) {
    case SweepKernelVersion::kPortable:
      return "portable";
    case SweepKernelVersion::kAvx2:
      return "avx2";
    case SweepKernelVersion::kAvx512:
      return "avx512";
  }
  throw std::invalid_argument("unknown version of the kernels of depth maps");
}

bool IsSweepKernelSupported(SweepKernelVersion version) {
#if defined(__x86_64__)
  if (version == SweepKernelVersion::kAvx512) {
    return __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512bw") &&
           __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512vl") &&
           __builtin_cpu_supports("fma");
  }
  if (version == SweepKernelVersion::kAvx2) {
    return __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma");
  }
#endif
  return version == SweepKernelVersion::kPortable;
}

SweepKernelVersion FastestSweepKernel() {
  return *std::find_if(kSweepKernelVersions.rbegin(), kSweepKernelVersions.rend(),
                       IsSweepKernelSupported);
}

const SweepKernels& SweepKernelsOf(SweepKernelVersion version) {
  if (!IsSweepKernelSupported(version)) {
    throw std::invalid_argument("this processor does not run the kernels of depth maps for " +
                                SweepKernelName(version));
  }
#if defined(__x86_64__)
  static const SweepKernels avx2 = Avx2SweepKernels(), avx512 = Avx512SweepKernels();
  if (version == SweepKernelVersion::kAvx512) return avx512;
  if (version == SweepKernelVersion::kAvx2) return avx2;
#endif
  static const SweepKernels portable = PortableSweepKernels();
  return portable;
}

}  // namespace skein
