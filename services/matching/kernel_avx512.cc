#include <immintrin.h>

#include "matching/kernel_block.h"

namespace skein {
namespace {

constexpr int kVectors = kAvx512PanelColumns / 16;
constexpr int kTileRows = 4;
constexpr int kSteps = 32;  // of four dimensions

// Products ab of kRows rows with one panel. vpdpbusd takes uint8 x int8 and adds four products to
// an int32 without saturation.
template <int kRows>
inline void Multiply(const uint8_t* rows, const uint8_t* panel, __m512i (&ab)[kRows][kVectors]) {
  for (int r = 0; r < kRows; ++r) {
    for (int v = 0; v < kVectors; ++v) ab[r][v] = _mm512_setzero_si512();
  }
  for (int k = 0; k < kSteps; ++k) {
    __m512i b[kVectors];
    for (int v = 0; v < kVectors; ++v) b[v] = _mm512_load_si512(panel + 256 * k + 64 * v);
    for (int r = 0; r < kRows; ++r) {
      int32_t four;
      __builtin_memcpy(&four, rows + 128 * r + 4 * k, 4);
      const __m512i a = _mm512_set1_epi32(four);
      for (int v = 0; v < kVectors; ++v) ab[r][v] = _mm512_dpbusd_epi32(ab[r][v], b[v], a);
    }
  }
}

inline void Insert(const __m512i key, __m512i* best, __m512i* second) {
  *second = _mm512_min_epi32(*second, _mm512_max_epi32(*best, key));
  *best = _mm512_min_epi32(*best, key);
}

template <int kRows>
inline void ProcessTile(const BlockTask& task, int row, int panel) {
  const int column = panel * kAvx512PanelColumns;
  __m512i ab[kRows][kVectors];
  Multiply<kRows>(task.rows + 128 * row, task.columns + 128 * column, ab);

  __m512i column_key[kVectors], column_best[kVectors], column_second[kVectors];
  for (int v = 0; v < kVectors; ++v) {
    column_key[v] = _mm512_load_si512(task.column_keys + column + 16 * v);
    column_best[v] = _mm512_load_si512(task.column_best + column + 16 * v);
    column_second[v] = _mm512_load_si512(task.column_second + column + 16 * v);
  }
  for (int r = 0; r < kRows; ++r) {
    const __m512i row_key = _mm512_set1_epi32(task.row_keys[row + r]);
    __m512i row_best = _mm512_load_si512(task.row_best + 16 * (row + r));
    __m512i row_second = _mm512_load_si512(task.row_second + 16 * (row + r));
    for (int v = 0; v < kVectors; ++v) {
      const __m512i key = _mm512_sub_epi32(column_key[v], _mm512_slli_epi32(ab[r][v], 9));
      Insert(key, &row_best, &row_second);
      Insert(_mm512_add_epi32(key, row_key), &column_best[v], &column_second[v]);
    }
    _mm512_store_si512(task.row_best + 16 * (row + r), row_best);
    _mm512_store_si512(task.row_second + 16 * (row + r), row_second);
  }
  for (int v = 0; v < kVectors; ++v) {
    _mm512_store_si512(task.column_best + column + 16 * v, column_best[v]);
    _mm512_store_si512(task.column_second + column + 16 * v, column_second[v]);
  }
}

}  // namespace

void ProcessBlockAvx512Vnni(const BlockTask& task) {
  for (int panel = 0; panel < task.num_panels; ++panel) {
    int row = 0;
    for (; row + kTileRows <= task.num_rows; row += kTileRows) {
      ProcessTile<kTileRows>(task, row, panel);
    }
    for (; row < task.num_rows; ++row) ProcessTile<1>(task, row, panel);
  }
}

void ProcessDotsAvx512Vnni(const DotTask& task) {
  const __m512i low = _mm512_loadu_si512(task.a), high = _mm512_loadu_si512(task.a + 64);
  const __m512i zero = _mm512_setzero_si512();
  for (int i = 0; i < task.count; ++i) {
    const uint8_t* b = task.descriptors + 128 * static_cast<uint64_t>(task.indices[i]);
    __m512i sum = _mm512_dpbusd_epi32(zero, low, _mm512_loadu_si512(b));
    sum = _mm512_dpbusd_epi32(sum, high, _mm512_loadu_si512(b + 64));
    task.dots[i] = _mm512_reduce_add_epi32(sum);
  }
}

}  // namespace skein
