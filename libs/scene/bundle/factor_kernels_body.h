#pragma once

// Included by one file for each instruction set, which is compiled with its -m flags. Everything is
// in an anonymous namespace and nothing of the standard library is called: the linker could use
// inline code of this file elsewhere. Vectors are GCC's and Clang's vector_size.

#include "bundle/factor_kernels.h"

namespace skein {
namespace {

#if defined(__AVX512F__)
constexpr int kLanes = 8;
#elif defined(__AVX2__)
constexpr int kLanes = 4;
#else
constexpr int kLanes = 2;
#endif

typedef double Lanes __attribute__((vector_size(8 * kLanes)));

inline Lanes Load(const double* p) {
  Lanes v;
  __builtin_memcpy(&v, p, sizeof v);
  return v;
}
inline void Subtract(const Lanes& v, double* p) {
  const Lanes rest = Load(p) - v;
  __builtin_memcpy(p, &rest, sizeof rest);
}

// The sums stay in registers: 2 x kTileColumns of them.
void SubtractTile(const TileTask& task) {
  Lanes low[kTileColumns] = {}, high[kTileColumns] = {};
  const double* A = task.A;
  const double* B = task.B;
  for (int k = 0; k < task.depth; ++k, A += 2 * kLanes, B += kTileColumns) {
    const Lanes a_low = Load(A), a_high = Load(A + kLanes);
#pragma GCC unroll 6
    for (int column = 0; column < kTileColumns; ++column) {
      low[column] += a_low * B[column];
      high[column] += a_high * B[column];
    }
  }
#pragma GCC unroll 6
  for (int column = 0; column < kTileColumns; ++column) {
    Subtract(low[column], task.C + column * task.stride);
    Subtract(high[column], task.C + column * task.stride + kLanes);
  }
}

// Rows 0 to 3 and rows 4 and 5 of a column.
typedef double Four __attribute__((vector_size(32)));
typedef double Two __attribute__((vector_size(16)));
struct Column {
  Four upper;
  Two lower;
};
inline Column LoadColumn(const double* p) {
  Column column;
  __builtin_memcpy(&column.upper, p, sizeof column.upper);
  __builtin_memcpy(&column.lower, p + 4, sizeof column.lower);
  return column;
}

void AddProduct(const double* Y, const double* W, double* C) {
  const Column y0 = LoadColumn(Y), y1 = LoadColumn(Y + 6), y2 = LoadColumn(Y + 12);
#pragma GCC unroll 6
  for (int j = 0; j < 6; ++j) {
    Column c = LoadColumn(C + 6 * j);
    c.upper += y0.upper * W[j] + y1.upper * W[6 + j] + y2.upper * W[12 + j];
    c.lower += y0.lower * W[j] + y1.lower * W[6 + j] + y2.lower * W[12 + j];
    __builtin_memcpy(C + 6 * j, &c.upper, sizeof c.upper);
    __builtin_memcpy(C + 6 * j + 4, &c.lower, sizeof c.lower);
  }
}

FactorKernel MakeKernel() { return {2 * kLanes, SubtractTile, AddProduct}; }

}  // namespace
}  // namespace skein
