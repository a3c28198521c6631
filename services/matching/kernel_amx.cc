#include <immintrin.h>

#include "matching/kernel_block.h"

namespace skein {
namespace {

constexpr int kTileBytes =
    64;  // a row of a tile: 64 dimensions of a, 16 columns of four of b or ab
constexpr int kVectors = kAvx512PanelColumns / 16;
constexpr int kPanelStride = 4 * kAvx512PanelColumns;  // bytes from four dimensions to the next

// Intel, "Intrinsics Guide", LDTILECFG: all eight tiles are 16 rows of 64 bytes.
struct alignas(64) TileConfig {
  uint8_t palette = 1;
  uint8_t start_row = 0;
  uint8_t reserved[14] = {};
  uint16_t row_bytes[16] = {64, 64, 64, 64, 64, 64, 64, 64};
  uint8_t rows[16] = {16, 16, 16, 16, 16, 16, 16, 16};
};

// Products ab of 16 rows with one panel: ab[row][column]. tdpbuud adds four products uint8 x uint8
// to an int32. Tiles: 0 to 3 ab, 4 and 5 the rows' halves of 64 dimensions, 6 and 7 columns.
inline void Multiply(const uint8_t* rows, const uint8_t* panel, int32_t* ab) {
  const uint8_t* upper = panel + kAmxTileRows * kPanelStride;
  _tile_zero(0);
  _tile_zero(1);
  _tile_zero(2);
  _tile_zero(3);
  _tile_loadd(4, rows, 128);
  _tile_loadd(5, rows + 64, 128);
  _tile_loadd(6, panel, kPanelStride);
  _tile_loadd(7, panel + kTileBytes, kPanelStride);
  _tile_dpbuud(0, 4, 6);
  _tile_dpbuud(1, 4, 7);
  _tile_loadd(6, panel + 2 * kTileBytes, kPanelStride);
  _tile_loadd(7, panel + 3 * kTileBytes, kPanelStride);
  _tile_dpbuud(2, 4, 6);
  _tile_dpbuud(3, 4, 7);
  _tile_loadd(6, upper, kPanelStride);
  _tile_loadd(7, upper + kTileBytes, kPanelStride);
  _tile_dpbuud(0, 5, 6);
  _tile_dpbuud(1, 5, 7);
  _tile_loadd(6, upper + 2 * kTileBytes, kPanelStride);
  _tile_loadd(7, upper + 3 * kTileBytes, kPanelStride);
  _tile_dpbuud(2, 5, 6);
  _tile_dpbuud(3, 5, 7);
  constexpr int kStride = 4 * kAvx512PanelColumns;
  _tile_stored(0, ab, kStride);
  _tile_stored(1, ab + 16, kStride);
  _tile_stored(2, ab + 32, kStride);
  _tile_stored(3, ab + 48, kStride);
}

inline void Insert(const __m512i key, __m512i* best, __m512i* second) {
  *second = _mm512_min_epi32(*second, _mm512_max_epi32(*best, key));
  *best = _mm512_min_epi32(*best, key);
}

// Of the products of num_rows rows with one panel.
inline void Scan(const BlockTask& task, int row, int num_rows, int column, const int32_t* ab) {
  __m512i column_key[kVectors], column_best[kVectors], column_second[kVectors];
  for (int v = 0; v < kVectors; ++v) {
    column_key[v] = _mm512_load_si512(task.column_keys + column + 16 * v);
    column_best[v] = _mm512_load_si512(task.column_best + column + 16 * v);
    column_second[v] = _mm512_load_si512(task.column_second + column + 16 * v);
  }
  for (int r = row; r < row + num_rows; ++r, ab += kAvx512PanelColumns) {
    const __m512i row_key = _mm512_set1_epi32(task.row_keys[r]);
    __m512i row_best = _mm512_load_si512(task.row_best + 16 * r);
    __m512i row_second = _mm512_load_si512(task.row_second + 16 * r);
    for (int v = 0; v < kVectors; ++v) {
      const __m512i product = _mm512_load_si512(ab + 16 * v);
      const __m512i key = _mm512_sub_epi32(column_key[v], _mm512_slli_epi32(product, 9));
      Insert(key, &row_best, &row_second);
      Insert(_mm512_add_epi32(key, row_key), &column_best[v], &column_second[v]);
    }
    _mm512_store_si512(task.row_best + 16 * r, row_best);
    _mm512_store_si512(task.row_second + 16 * r, row_second);
  }
  for (int v = 0; v < kVectors; ++v) {
    _mm512_store_si512(task.column_best + column + 16 * v, column_best[v]);
    _mm512_store_si512(task.column_second + column + 16 * v, column_second[v]);
  }
}

}  // namespace

void ProcessBlockAmx(const BlockTask& task) {
  const TileConfig config;
  _tile_loadconfig(&config);
  alignas(64) int32_t ab[kAmxTileRows * kAvx512PanelColumns];
  for (int panel = 0; panel < task.num_panels; ++panel) {
    const int column = panel * kAvx512PanelColumns;
    for (int row = 0; row < task.num_rows; row += kAmxTileRows) {
      Multiply(task.rows + 128 * row, task.columns + 128 * column, ab);
      const int left = task.num_rows - row;
      Scan(task, row, left < kAmxTileRows ? left : kAmxTileRows, column, ab);
    }
  }
  _tile_release();
}

}  // namespace skein
