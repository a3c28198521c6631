#pragma once

// Included by one file for each version of NEON, which is compiled with its -march flag. Everything
// is in an anonymous namespace: the linker could use inline code of this file elsewhere. Each file
// has a class Product with
//
//   Multiply<kRows>  products ab of kRows rows with one panel
//   Dot              product of two descriptors

#include <arm_neon.h>

#include "matching/kernel_block.h"

namespace skein {
namespace {

constexpr int kLanes = 4;
constexpr int kVectors = kNeonPanelColumns / kLanes;
constexpr int kTileRows = 4;

template <int kRows>
using Tile = uint32x4_t[kRows][kVectors];

struct Keys {
  int32x4_t best, second;

  static Keys Load(const int32_t* best, const int32_t* second) {
    return {vld1q_s32(best), vld1q_s32(second)};
  }
  void Store(int32_t* to_best, int32_t* to_second) const {
    vst1q_s32(to_best, best);
    vst1q_s32(to_second, second);
  }
  void Insert(int32x4_t key) {
    second = vminq_s32(second, vmaxq_s32(best, key));
    best = vminq_s32(best, key);
  }
};

inline int32x4_t KeyOf(int32x4_t column_key, uint32x4_t ab) {
  return vsubq_s32(column_key, vreinterpretq_s32_u32(vshlq_n_u32(ab, 9)));
}

template <class Product, int kRows>
inline void ProcessTile(const BlockTask& task, int row, int panel) {
  const int column = panel * kNeonPanelColumns;
  Tile<kRows> ab;
  Product::Multiply(task.rows + 128 * row, task.columns + 128 * column, ab);

  int32x4_t column_key[kVectors];
  Keys columns[kVectors];
  for (int v = 0; v < kVectors; ++v) {
    const int at = column + kLanes * v;
    column_key[v] = vld1q_s32(task.column_keys + at);
    columns[v] = Keys::Load(task.column_best + at, task.column_second + at);
  }
  for (int r = 0; r < kRows; ++r) {
    const int32x4_t row_key = vdupq_n_s32(task.row_keys[row + r]);
    const int at = kLanes * (row + r);
    Keys nearest = Keys::Load(task.row_best + at, task.row_second + at);
    for (int v = 0; v < kVectors; ++v) {
      const int32x4_t key = KeyOf(column_key[v], ab[r][v]);
      nearest.Insert(key);
      columns[v].Insert(vaddq_s32(key, row_key));
    }
    nearest.Store(task.row_best + at, task.row_second + at);
  }
  for (int v = 0; v < kVectors; ++v) {
    const int at = column + kLanes * v;
    columns[v].Store(task.column_best + at, task.column_second + at);
  }
}

template <class Product>
inline void ProcessBlock(const BlockTask& task) {
  for (int panel = 0; panel < task.num_panels; ++panel) {
    int row = 0;
    for (; row + kTileRows <= task.num_rows; row += kTileRows) {
      ProcessTile<Product, kTileRows>(task, row, panel);
    }
    for (; row < task.num_rows; ++row) ProcessTile<Product, 1>(task, row, panel);
  }
}

template <class Product>
inline void ProcessDots(const DotTask& task) {
  for (int i = 0; i < task.count; ++i) {
    const uint8_t* b = task.descriptors + 128 * static_cast<uint64_t>(task.indices[i]);
    task.dots[i] = static_cast<int32_t>(Product::Dot(task.a, b));
  }
}

}  // namespace
}  // namespace skein
