// The innermost steps of the Schur complement: its sum over the points, and its dense Cholesky
// decomposition.
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
  // C += Y W'. Y and W: 6 x 3, C: 6 x 6, column major, one column after the other.
  void (*add_product)(const double* Y, const double* W, double* C);
};

// Throws std::invalid_argument for a version that is not supported here.
FactorKernel FactorKernelOf(InstructionSet version);

FactorKernel PortableFactorKernel();
FactorKernel Avx2FactorKernel();
FactorKernel Avx512FactorKernel();

}  // namespace skein
