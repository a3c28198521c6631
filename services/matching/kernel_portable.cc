#include "matching/kernel_block.h"

namespace skein {
namespace {

// With int16 the compiler finds instructions that add two products.
inline void Widen(const uint8_t* from, int count, int16_t* to) {
  for (int k = 0; k < count; ++k) to[k] = from[k];
}

inline int32_t Dot(const int16_t* a, const int16_t* b) {
  int32_t sum = 0;
  for (int k = 0; k < 128; ++k) sum += static_cast<int32_t>(a[k]) * static_cast<int32_t>(b[k]);
  return sum;
}

inline int32_t Min(int32_t a, int32_t b) { return a < b ? a : b; }
inline int32_t Max(int32_t a, int32_t b) { return a < b ? b : a; }

inline void Insert(const int32_t key, int32_t* best, int32_t* second) {
  *second = Min(*second, Max(*best, key));
  *best = Min(*best, key);
}

}  // namespace

void ProcessBlockPortable(const BlockTask& task) {
  int16_t rows[kBlockRows * 128], column_values[128];
  Widen(task.rows, task.num_rows * 128, rows);
  for (int column = 0; column < task.num_panels; ++column) {
    Widen(task.columns + 128 * column, 128, column_values);
    const int32_t column_key = task.column_keys[column];
    int32_t column_best = task.column_best[column];
    int32_t column_second = task.column_second[column];
    for (int row = 0; row < task.num_rows; ++row) {
      const int32_t ab = Dot(rows + 128 * row, column_values);
      const int32_t key = column_key - ab * 512;
      Insert(key, &task.row_best[row], &task.row_second[row]);
      Insert(key + task.row_keys[row], &column_best, &column_second);
    }
    task.column_best[column] = column_best;
    task.column_second[column] = column_second;
  }
}

void ProcessDotsPortable(const DotTask& task) {
  for (int i = 0; i < task.count; ++i) {
    const uint8_t* b = task.descriptors + 128 * static_cast<uint64_t>(task.indices[i]);
    int32_t sum = 0;
    for (int k = 0; k < 128; ++k) sum += static_cast<int32_t>(task.a[k]) * b[k];
    task.dots[i] = sum;
  }
}

}  // namespace skein
