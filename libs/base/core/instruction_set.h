// Instruction sets that kernels are compiled for.
#pragma once

#include <array>
#include <string>

namespace skein {

enum class InstructionSet { kPortable, kAvx2, kAvx512 };

// All, the slowest first.
constexpr std::array<InstructionSet, 3> kInstructionSets = {
    InstructionSet::kPortable, InstructionSet::kAvx2, InstructionSet::kAvx512};

// "portable", "avx2", "avx512".
std::string InstructionSetName(InstructionSet set);

// Whether this processor and operating system run it: AVX2 and AVX-512 (F, BW, DQ, VL) with FMA.
bool IsInstructionSetSupported(InstructionSet set);

// Throws std::invalid_argument if it is not supported here: "this processor does not run WHAT for
// avx512".
void RequireInstructionSet(InstructionSet set, const std::string& what);

// The fastest one supported here.
InstructionSet FastestInstructionSet();

}  // namespace skein
