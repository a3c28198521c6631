#include <immintrin.h>

#include "matching/kernel_block.h"

namespace skein {
namespace {

constexpr int kVectors = kAvx2PanelColumns / 8;
constexpr int kTileRows = 4;
constexpr int kSteps = 64;  // of two dimensions

inline __m256i Load(const void* p) { return _mm256_load_si256(static_cast<const __m256i*>(p)); }
inline void Store(void* p, __m256i v) { _mm256_store_si256(static_cast<__m256i*>(p), v); }

// Products ab of kRows rows with one panel, int16 x int16 (vpmaddubsw would saturate).
template <int kRows>
inline void Multiply(const int16_t* rows, const int16_t* panel, __m256i (&ab)[kRows][kVectors]) {
  for (int r = 0; r < kRows; ++r) {
    for (int v = 0; v < kVectors; ++v) ab[r][v] = _mm256_setzero_si256();
  }
  for (int k = 0; k < kSteps; ++k) {
    __m256i b[kVectors];
    for (int v = 0; v < kVectors; ++v) b[v] = Load(panel + 2 * kAvx2PanelColumns * k + 16 * v);
    for (int r = 0; r < kRows; ++r) {
      int32_t two;
      __builtin_memcpy(&two, rows + 128 * r + 2 * k, 4);
      const __m256i a = _mm256_set1_epi32(two);
      for (int v = 0; v < kVectors; ++v) {
        ab[r][v] = _mm256_add_epi32(ab[r][v], _mm256_madd_epi16(b[v], a));
      }
    }
  }
}

inline void Insert(const __m256i key, __m256i* best, __m256i* second) {
  *second = _mm256_min_epi32(*second, _mm256_max_epi32(*best, key));
  *best = _mm256_min_epi32(*best, key);
}

template <int kRows>
inline void ProcessTile(const BlockTask& task, int row, int panel) {
  const int column = panel * kAvx2PanelColumns;
  __m256i ab[kRows][kVectors];
  Multiply<kRows>(static_cast<const int16_t*>(task.rows) + 128 * row,
                  static_cast<const int16_t*>(task.columns) + 128 * column, ab);

  for (int r = 0; r < kRows; ++r) {
    const __m256i row_key = _mm256_set1_epi32(task.row_keys[row + r]);
    __m256i row_best = Load(task.row_best + 8 * (row + r));
    __m256i row_second = Load(task.row_second + 8 * (row + r));
    for (int v = 0; v < kVectors; ++v) {
      const __m256i key =
          _mm256_sub_epi32(Load(task.column_keys + column + 8 * v), _mm256_slli_epi32(ab[r][v], 9));
      Insert(key, &row_best, &row_second);
      ab[r][v] = _mm256_add_epi32(key, row_key);
    }
    Store(task.row_best + 8 * (row + r), row_best);
    Store(task.row_second + 8 * (row + r), row_second);
  }
  for (int v = 0; v < kVectors; ++v) {
    __m256i best = Load(task.column_best + column + 8 * v);
    __m256i second = Load(task.column_second + column + 8 * v);
    for (int r = 0; r < kRows; ++r) Insert(ab[r][v], &best, &second);
    Store(task.column_best + column + 8 * v, best);
    Store(task.column_second + column + 8 * v, second);
  }
}

}  // namespace

void ProcessBlockAvx2(const BlockTask& task) {
  for (int panel = 0; panel < task.num_panels; ++panel) {
    int row = 0;
    for (; row + kTileRows <= task.num_rows; row += kTileRows) {
      ProcessTile<kTileRows>(task, row, panel);
    }
    for (; row < task.num_rows; ++row) ProcessTile<1>(task, row, panel);
  }
}

void ProcessDotsAvx2(const DotTask& task) {
  __m256i a[8];
  for (int k = 0; k < 8; ++k) {
    a[k] = _mm256_cvtepu8_epi16(_mm_loadu_si128(reinterpret_cast<const __m128i*>(task.a + 16 * k)));
  }
  for (int i = 0; i < task.count; ++i) {
    const uint8_t* b = task.descriptors + 128 * static_cast<uint64_t>(task.indices[i]);
    __m256i sum = _mm256_setzero_si256();
    for (int k = 0; k < 8; ++k) {
      const __m256i wide =
          _mm256_cvtepu8_epi16(_mm_loadu_si128(reinterpret_cast<const __m128i*>(b + 16 * k)));
      sum = _mm256_add_epi32(sum, _mm256_madd_epi16(a[k], wide));
    }
    __m128i half = _mm_add_epi32(_mm256_castsi256_si128(sum), _mm256_extracti128_si256(sum, 1));
    half = _mm_add_epi32(half, _mm_shuffle_epi32(half, 0x4e));
    half = _mm_add_epi32(half, _mm_shuffle_epi32(half, 0xb1));
    task.dots[i] = _mm_cvtsi128_si32(half);
  }
}

}  // namespace skein
