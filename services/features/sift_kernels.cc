#include "features/sift_kernels.h"

#include <algorithm>
#include <stdexcept>

namespace skein {

std::string SiftKernelName(SiftKernelVersion version) {
  switch (version) {
    case SiftKernelVersion::kPortable:
      return "portable";
    case SiftKernelVersion::kAvx2:
      return "avx2";
    case SiftKernelVersion::kAvx512:
      return "avx512";
  }
  throw std::invalid_argument("unknown version of SIFT's kernels");
}

bool IsSiftKernelSupported(SiftKernelVersion version) {
#if defined(__x86_64__)
  if (version == SiftKernelVersion::kAvx512) {
    return __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512bw") &&
           __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512vl") &&
           __builtin_cpu_supports("fma");
  }
  if (version == SiftKernelVersion::kAvx2) {
    return __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma");
  }
#endif
  return version == SiftKernelVersion::kPortable;
}

SiftKernelVersion FastestSiftKernel() {
  return *std::find_if(kSiftKernelVersions.rbegin(), kSiftKernelVersions.rend(),
                       IsSiftKernelSupported);
}

const SiftKernels& KernelsOf(SiftKernelVersion version) {
  if (!IsSiftKernelSupported(version)) {
    throw std::invalid_argument("this processor does not run SIFT's kernels for " +
                                SiftKernelName(version));
  }
#if defined(__x86_64__)
  static const SiftKernels avx2 = Avx2SiftKernels(), avx512 = Avx512SiftKernels();
  if (version == SiftKernelVersion::kAvx512) return avx512;
  if (version == SiftKernelVersion::kAvx2) return avx2;
#endif
  static const SiftKernels portable = PortableSiftKernels();
  return portable;
}

}  // namespace skein
