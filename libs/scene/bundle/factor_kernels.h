// The innermost step of a dense Cholesky decomposition.
#pragma once

#include <cstddef>

#include "core/instruction_set.h"

namespace skein {

constexpr int kTileColumns = 6;
constexpr int kMaxTileRows = 16;

// C -= A' B. A: `depth` rows of `rows` values, one row after the other. B: `depth` rows of
// kTileColumns values. C: column major, `stride` values from column to column.
struct TileTask {
  int depth;
  const double* A;
  const double* B;
  double* C;
  std::ptrdiff_t stride;
};

// Results of two versions differ in the last bits: some multiply and add at once.
struct FactorKernel {
  int rows;  // of a tile; divides kMaxTileRows
  void (*subtract)(const TileTask&);
};

// Throws std::invalid_argument for a version that is not supported here.
FactorKernel FactorKernelOf(InstructionSet version);

FactorKernel PortableFactorKernel();
FactorKernel Avx2FactorKernel();
FactorKernel Avx512FactorKernel();

}  // namespace skein
