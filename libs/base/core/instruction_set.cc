#include "core/instruction_set.h"

#include <algorithm>
#include <stdexcept>

namespace skein {

std::string InstructionSetName(InstructionSet set) {
  switch (set) {
    case InstructionSet::kPortable:
      return "portable";
    case InstructionSet::kAvx2:
      return "avx2";
    case InstructionSet::kAvx512:
      return "avx512";
  }
  throw std::invalid_argument("unknown instruction set");
}

bool IsInstructionSetSupported(InstructionSet set) {
#if defined(__x86_64__)
  if (set == InstructionSet::kAvx512) {
    return __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512bw") &&
           __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512vl") &&
           __builtin_cpu_supports("fma");
  }
  if (set == InstructionSet::kAvx2) {
    return __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma");
  }
#endif
  return set == InstructionSet::kPortable;
}

void RequireInstructionSet(InstructionSet set, const std::string& what) {
  if (IsInstructionSetSupported(set)) return;
  throw std::invalid_argument("this processor does not run " + what + " for " +
                              InstructionSetName(set));
}

InstructionSet FastestInstructionSet() {
  return *std::find_if(kInstructionSets.rbegin(), kInstructionSets.rend(),
                       IsInstructionSetSupported);
}

}  // namespace skein
