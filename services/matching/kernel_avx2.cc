#include <immintrin.h>

#include "matching/kernel_block.h"

namespace skein {
namespace {

constexpr int kVectors = kAvx2PanelColumns / 8;
constexpr int kTileRows = 4;
constexpr int kSteps = 32;  // of four dimensions

inline __m256i LoadUnaligned(const void* p) {
  return _mm256_loadu_si256(static_cast<const __m256i*>(p));
}
inline __m256i Load(const void* p) { return _mm256_load_si256(static_cast<const __m256i*>(p)); }
inline void Store(void* p, __m256i v) { _mm256_store_si256(static_cast<__m256i*>(p), v); }

// Adds the upper and the lower uint16 of each int32.
inline __m256i AddHalves(__m256i v) {
  return _mm256_add_epi32(_mm256_srli_epi32(v, 16), _mm256_and_si256(v, _mm256_set1_epi32(0xffff)));
}

// Products ab of kRows rows with one panel. vpmaddubsw adds two products uint8 x int8 to an int16:
// 2 * 127^2 fits. A lane's two sums of these are uint16, and so are theirs over all dimensions of
// compact descriptors.
template <int kRows>
inline void Multiply(const uint8_t* rows, const uint8_t* panel, __m256i (&ab)[kRows][kVectors]) {
  for (int r = 0; r < kRows; ++r) {
    for (int v = 0; v < kVectors; ++v) ab[r][v] = _mm256_setzero_si256();
  }
  // GCC 12 keeps one of the sums in memory in a loop of single steps.
#pragma GCC unroll 2
  for (int k = 0; k < kSteps; ++k) {
    __m256i b[kVectors];
    for (int v = 0; v < kVectors; ++v) b[v] = Load(panel + 4 * kAvx2PanelColumns * k + 32 * v);
    for (int r = 0; r < kRows; ++r) {
      int32_t four;
      __builtin_memcpy(&four, rows + 128 * r + 4 * k, 4);
      const __m256i a = _mm256_set1_epi32(four);
      for (int v = 0; v < kVectors; ++v) {
        ab[r][v] = _mm256_add_epi16(ab[r][v], _mm256_maddubs_epi16(b[v], a));
      }
    }
  }
  for (int r = 0; r < kRows; ++r) {
    for (int v = 0; v < kVectors; ++v) ab[r][v] = AddHalves(ab[r][v]);
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
  Multiply<kRows>(task.rows + 128 * row, task.columns + 128 * column, ab);

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
  __m256i a[4];
  for (int k = 0; k < 4; ++k) a[k] = LoadUnaligned(task.a + 32 * k);
  for (int i = 0; i < task.count; ++i) {
    const uint8_t* b = task.descriptors + 128 * static_cast<uint64_t>(task.indices[i]);
    __m256i sum = _mm256_setzero_si256();
    for (int k = 0; k < 4; ++k) {
      sum = _mm256_add_epi16(sum, _mm256_maddubs_epi16(a[k], LoadUnaligned(b + 32 * k)));
    }
    sum = AddHalves(sum);
    __m128i half = _mm_add_epi32(_mm256_castsi256_si128(sum), _mm256_extracti128_si256(sum, 1));
    half = _mm_add_epi32(half, _mm_shuffle_epi32(half, 0x4e));
    half = _mm_add_epi32(half, _mm_shuffle_epi32(half, 0xb1));
    task.dots[i] = _mm_cvtsi128_si32(half);
  }
}

}  // namespace skein
