#pragma once

// Included by one file for each instruction set, which is compiled with its -m flags. Everything is
// in an anonymous namespace and nothing of the standard library is called: the linker could use
// inline code of this file elsewhere. Vectors are GCC's and Clang's vector_size; instructions that
// these do not reach have a portable twin beside them.

#if defined(__AVX2__)
#include <immintrin.h>
#elif defined(__aarch64__)
#include <arm_neon.h>
#endif

#include "depth/sweep_kernels.h"

namespace skein {
namespace {

// Bytes of a register: GCC compares longer vectors byte by byte.
#if defined(__AVX2__)
constexpr int kByteLanes = 32;
#else
constexpr int kByteLanes = 16;
#endif

typedef uint8_t Bytes __attribute__((vector_size(kByteLanes)));
typedef uint16_t Words __attribute__((vector_size(2 * kByteLanes)));
typedef uint8_t Block __attribute__((vector_size(16)));
typedef uint16_t HalfWords __attribute__((vector_size(kByteLanes)));

template <class V, class T>
inline V Load(const T* p) {
  V v;
  __builtin_memcpy(&v, p, sizeof v);
  return v;
}
template <class V, class T>
inline void Store(T* p, V v) {
  __builtin_memcpy(p, &v, sizeof v);
}
template <class V>
inline V Min(V a, V b) {
  return a < b ? a : b;
}
template <class V>
inline V Max(V a, V b) {
  return a > b ? a : b;
}
inline Bytes Splat(uint8_t value) { return Bytes{} + value; }

// ---- Warp ----

constexpr int kHalfWeight = kWeightUnit / 2, kWeightBits = 6;
static_assert(1 << kWeightBits == kWeightUnit);

inline Bytes Between(Bytes a, Bytes b, uint16_t weight) {
  const Words wide_a = __builtin_convertvector(a, Words);
  const Words wide_b = __builtin_convertvector(b, Words);
  const Words sum = wide_a * static_cast<uint16_t>(kWeightUnit - weight) + wide_b * weight;
  // A shift: GCC divides vectors element by element.
  return __builtin_convertvector((sum + static_cast<uint16_t>(kHalfWeight)) >> kWeightBits, Bytes);
}

// Two blocks of columns.
inline void WarpBlocks(const WarpTask& task, const uint8_t* row, int x) {
  const int32_t* window = task.window + x / kSweepBlock;
#if defined(__AVX2__)
  const auto load = [&](int i) {
    return _mm_loadu_si128(reinterpret_cast<const __m128i*>(row + window[i]));
  };
  const __m256i source = _mm256_set_m128i(load(1), load(0));
  const __m256i pairs = _mm256_loadu_si256(reinterpret_cast<const __m256i*>(task.pairs + 2 * x));
  const __m256i weights =
      _mm256_loadu_si256(reinterpret_cast<const __m256i*>(task.weights + 2 * x));
  const __m256i sums = _mm256_maddubs_epi16(_mm256_shuffle_epi8(source, pairs), weights);
  const __m256i rounded =
      _mm256_srli_epi16(_mm256_add_epi16(sums, _mm256_set1_epi16(kHalfWeight)), kWeightBits);
  _mm_storeu_si128(
      reinterpret_cast<__m128i*>(task.out + x),
      _mm_packus_epi16(_mm256_castsi256_si128(rounded), _mm256_extracti128_si256(rounded, 1)));
#elif defined(__aarch64__)
  for (int i = 0; i < 2; ++i) {
    const int at = x + i * kSweepBlock;
    const uint8x16_t source = vqtbl1q_u8(vld1q_u8(row + window[i]), vld1q_u8(task.pairs + 2 * at));
    const uint8x16_t weights = vreinterpretq_u8_s8(vld1q_s8(task.weights + 2 * at));
    const uint16x8_t low = vmull_u8(vget_low_u8(source), vget_low_u8(weights));
    vst1_u8(task.out + at,
            vrshrn_n_u16(vpaddq_u16(low, vmull_high_u8(source, weights)), kWeightBits));
  }
#else
  for (int i = 0; i < 2 * kSweepBlock; ++i) {
    const uint8_t* from = row + window[i / kSweepBlock];
    const uint8_t* pair = task.pairs + 2 * (x + i);
    const int8_t* weight = task.weights + 2 * (x + i);
    const int sum = from[pair[0]] * weight[0] + from[pair[1]] * weight[1];
    task.out[x + i] = static_cast<uint8_t>((sum + kHalfWeight) >> kWeightBits);
  }
#endif
}

void BetweenRows(const WarpTask& task) {
  uint8_t* row = task.scratch + kSweepMargin;
  const uint16_t weight = static_cast<uint16_t>(task.below_weight);
  const int last = task.window[task.width / kSweepBlock - 1] + kSweepWindow;
  for (int x = task.window[0]; x < last; x += kByteLanes) {
    Store(row + x, Between(Load<Bytes>(task.above + x), Load<Bytes>(task.below + x), weight));
  }
}

void BetweenColumns(const WarpTask& task) {
  const uint8_t* row = task.scratch + kSweepMargin;
  for (int x = 0; x < task.width; x += 2 * kSweepBlock) WarpBlocks(task, row, x);
}

void Warp(const WarpTask* tasks, int count) {
  for (int i = 0; i < count; ++i) BetweenRows(tasks[i]);
  for (int i = 0; i < count; ++i) BetweenColumns(tasks[i]);
}

// ---- Census ----

// Every second pixel of the window, as on the black squares of a chessboard.
struct CensusPattern {
  int row[kCensusBits] = {}, column[kCensusBits] = {};
  constexpr CensusPattern() {
    int count = 0;
    for (int y = -kCensusRadius; y <= kCensusRadius; ++y) {
      for (int x = -kCensusRadius; x <= kCensusRadius; ++x) {
        if ((x + y) % 2 != 0 || (x == 0 && y == 0)) continue;
        row[count] = y + kCensusRadius;
        column[count++] = x;
      }
    }
  }
};
constexpr CensusPattern kPattern;

#if defined(__AVX512BW__)
constexpr int kCensusLanes = 64;
typedef __m512i CensusBytes;
typedef __mmask64 CensusMask;
inline CensusBytes LoadCensus(const uint8_t* p) { return _mm512_loadu_si512(p); }
inline void StoreCensus(uint8_t* p, CensusBytes v) { _mm512_storeu_si512(p, v); }
inline CensusBytes ZeroCensus() { return _mm512_setzero_si512(); }
inline CensusMask IsAbove(CensusBytes a, CensusBytes b) { return _mm512_cmpge_epu8_mask(a, b); }
inline CensusBytes Raise(CensusBytes v, int by) {
  return _mm512_adds_epu8(v, _mm512_set1_epi8(static_cast<char>(by)));
}
inline CensusBytes Count(CensusBytes count, CensusMask a, CensusMask b) {
  return _mm512_mask_sub_epi8(count, a ^ b, count, _mm512_set1_epi8(-1));
}
#else
constexpr int kCensusLanes = kByteLanes;
typedef Bytes CensusBytes;
typedef Bytes CensusMask;
inline CensusBytes LoadCensus(const uint8_t* p) { return Load<Bytes>(p); }
inline void StoreCensus(uint8_t* p, CensusBytes v) { Store(p, v); }
inline CensusBytes ZeroCensus() { return Bytes{}; }
#if defined(__aarch64__)
inline CensusMask IsAbove(CensusBytes a, CensusBytes b) { return Bytes(a >= b); }
#else
inline CensusMask IsAbove(CensusBytes a, CensusBytes b) { return Bytes(Max(a, b) == a); }
#endif
inline CensusBytes Raise(CensusBytes v, int by) {
  return Min(v, Splat(static_cast<uint8_t>(255 - by))) + static_cast<uint8_t>(by);
}
inline CensusBytes Count(CensusBytes count, CensusMask a, CensusMask b) { return count - (a ^ b); }
#endif

// Hamming distances of some columns to some views.
template <int kViews>
inline void Hamming(const CensusTask& task, const int* views, int x, uint8_t* const* out) {
  const CensusBytes middle = Raise(LoadCensus(task.reference[kCensusRadius] + x), task.threshold);
  CensusBytes middles[kViews], counts[kViews];
  for (int i = 0; i < kViews; ++i) {
    middles[i] = Raise(LoadCensus(task.views[views[i]][kCensusRadius] + x), task.threshold);
    counts[i] = ZeroCensus();
  }
#pragma GCC unroll 24
  for (int k = 0; k < kCensusBits; ++k) {
    const int row = kPattern.row[k], column = x + kPattern.column[k];
    const CensusMask bit = IsAbove(LoadCensus(task.reference[row] + column), middle);
    for (int i = 0; i < kViews; ++i) {
      const uint8_t* at = task.views[views[i]][row] + column;
      const CensusMask other = IsAbove(LoadCensus(at), middles[i]);
      counts[i] = Count(counts[i], bit, other);
    }
  }
  for (int i = 0; i < kViews; ++i) StoreCensus(out[views[i]] + x, counts[i]);
}

// To the views that show one of the columns.
inline void HammingOfSeen(const CensusTask& task, int x, uint8_t* const* out) {
  int seen[kMaxSweepViews], count = 0;
  for (int i = 0; i < task.num_views; ++i) {
    if (task.first[i] < x + kCensusLanes && task.last[i] > x) seen[count++] = i;
  }
  switch (count) {
    case 1:
      return Hamming<1>(task, seen, x, out);
    case 2:
      return Hamming<2>(task, seen, x, out);
    case 3:
      return Hamming<3>(task, seen, x, out);
  }
}

constexpr uint8_t kUnseen = 255;

inline void HideUnseen(const CensusTask& task, int view, uint8_t* costs) {
  const int first = task.first[view] < task.width ? task.first[view] : task.width;
  if (first > 0) __builtin_memset(costs, kUnseen, first);
  const int last = task.last[view] > first ? task.last[view] : first;
  if (last < task.width) __builtin_memset(costs + last, kUnseen, task.width - last);
}

void Census(const CensusTask& task) {
  uint8_t* costs[kMaxSweepViews];
  const int views = task.num_views;
  for (int i = 0; i < views; ++i) costs[i] = task.scratch + i * (task.width + kSweepMargin);
  for (int x = 0; x < task.width; x += kCensusLanes) HammingOfSeen(task, x, costs);
  for (int i = 0; i < views; ++i) HideUnseen(task, i, costs[i]);
  for (int x = 0; x < task.width; x += kByteLanes) {
    Bytes least = Splat(kCensusBits), sum = {};
    for (int i = 0; i < views; ++i) least = Min(least, Load<Bytes>(costs[i] + x));
    const Bytes limit = least + static_cast<uint8_t>(task.truncation);
    for (int i = 0; i < views; ++i) sum += Min(Load<Bytes>(costs[i] + x), limit);
    Store(task.out + x, sum);
  }
}

// ---- Paths ----

inline uint8_t LeastOf(Bytes v) {
#if defined(__AVX2__)
  const __m256i all = reinterpret_cast<__m256i>(v);
  const __m128i half = _mm_min_epu8(_mm256_castsi256_si128(all), _mm256_extracti128_si256(all, 1));
  const __m128i words = _mm_min_epu8(half, _mm_srli_epi16(half, 8));
  const __m128i low = _mm_and_si128(words, _mm_set1_epi16(0xff));
  return static_cast<uint8_t>(_mm_cvtsi128_si32(_mm_minpos_epu16(low)));
#elif defined(__aarch64__)
  return vminvq_u8(reinterpret_cast<uint8x16_t>(v));
#else
  uint8_t least = v[0];
  uint8_t all[kByteLanes];
  Store(all, v);
  for (int i = 1; i < kByteLanes; ++i) least = Min(least, all[i]);
  return least;
#endif
}

constexpr int kStepPadding = kSweepLanes;  // bytes before and behind a column's steps

struct Penalties {
  uint8_t small;
  uint8_t large;
};

// Costs of a path from those of the pixel before it on the path. Returns the least.
template <int kSteps>
inline uint8_t Extend(const uint8_t* before, uint8_t before_min, const uint8_t* cost,
                      const Penalties& penalties, uint8_t* now, Words (&sum)[kSteps / kByteLanes]) {
  const Bytes jump = Splat(static_cast<uint8_t>(before_min + penalties.large));
  const Bytes base = Splat(before_min);
  Bytes least = Splat(255);
#pragma GCC unroll 8
  for (int i = 0; i < kSteps / kByteLanes; ++i) {
    const uint8_t* p = before + i * kByteLanes;
    const Bytes beside = Min(Load<Bytes>(p - 1), Load<Bytes>(p + 1)) + penalties.small;
    const Bytes best = Min(Min(Load<Bytes>(p), beside), jump);
    const Bytes path = Load<Bytes>(cost + i * kByteLanes) + (best - base);
    Store(now + i * kByteLanes, path);
    least = Min(least, path);
    sum[i] += __builtin_convertvector(path, Words);
  }
  return LeastOf(least);
}

inline void Pad(uint8_t* steps, int count, uint8_t value) {
  Store(steps - kByteLanes, Splat(value));
  Store(steps + count, Splat(value));
}

inline int Difference(uint8_t a, uint8_t b) { return a < b ? b - a : a - b; }

template <int kSteps>
void PathsOf(const PathTask& task) {
  constexpr int kColumn = kSteps + 2 * kStepPadding;
  const uint8_t small = static_cast<uint8_t>(task.small_penalty);
  const uint8_t pad = static_cast<uint8_t>(255 - small);
  // Along the row: this pixel and the one before in turn.
  uint8_t* along[2] = {task.scratch + kStepPadding, task.scratch + kColumn + kStepPadding};
  for (uint8_t* steps : along) {
    __builtin_memset(steps, 0, kSteps);
    Pad(steps, kSteps, pad);
  }
  uint8_t along_min = 0;
  for (int k = 0; k < 3; ++k) {
    for (const int column : {0, task.width + 1}) {
      uint8_t* steps = task.now[k] + static_cast<int64_t>(column) * kColumn + kStepPadding;
      __builtin_memset(steps, 0, kSteps);
      Pad(steps, kSteps, pad);
      task.now_min[k][column] = 0;
    }
  }
  int x = task.direction > 0 ? 0 : task.width - 1;
  uint8_t grey_along = task.grey[x];
  for (int i = 0; i < task.width; ++i, x += task.direction) {
    const int64_t at = static_cast<int64_t>(x) * kSteps;
    const uint8_t* cost = task.cost + at;
    uint16_t* out = task.sum + at;
    Words sum[kSteps / kByteLanes] = {};
    if (task.sum_before != nullptr) __builtin_memcpy(sum, task.sum_before + at, sizeof sum);
    const uint8_t grey = task.grey[x];
    const auto penalties = [&](uint8_t other) {
      return Penalties{small, task.large_penalty[Difference(grey, other)]};
    };
    along_min = Extend<kSteps>(along[0], along_min, cost, penalties(grey_along), along[1], sum);
    uint8_t* const swapped = along[0];
    along[0] = along[1];
    along[1] = swapped;
    grey_along = grey;
    for (int k = 0; k < 3; ++k) {
      const int from = x + k;  // column x + k - 1, behind one column of border
      uint8_t* now = task.now[k] + static_cast<int64_t>(x + 1) * kColumn + kStepPadding;
      const uint8_t* before = task.before[k] + static_cast<int64_t>(from) * kColumn + kStepPadding;
      const uint8_t other = task.grey_before == nullptr ? grey : task.grey_before[x + k - 1];
      task.now_min[k][x + 1] =
          Extend<kSteps>(before, task.before_min[k][from], cost, penalties(other), now, sum);
      Pad(now, kSteps, pad);
    }
    for (int j = 0; j < kSteps / kByteLanes; ++j) Store(out + j * kByteLanes, sum[j]);
  }
}

void Paths(const PathTask& task) {
  switch (task.steps / kSweepLanes) {
    case 1:
      return PathsOf<32>(task);
    case 2:
      return PathsOf<64>(task);
    case 3:
      return PathsOf<96>(task);
    case 4:
      return PathsOf<128>(task);
    case 5:
      return PathsOf<160>(task);
    case 6:
      return PathsOf<192>(task);
    case 7:
      return PathsOf<224>(task);
  }
}

// ---- Choice ----

constexpr uint16_t kNoSum = 0xffff;
constexpr int kHalfLanes = kByteLanes / 2;

inline uint16_t LeastOf(HalfWords v) {
#if defined(__AVX2__)
  const __m256i all = reinterpret_cast<__m256i>(v);
  const __m128i half = _mm_min_epu16(_mm256_castsi256_si128(all), _mm256_extracti128_si256(all, 1));
  return static_cast<uint16_t>(_mm_cvtsi128_si32(_mm_minpos_epu16(half)));
#elif defined(__aarch64__)
  return vminvq_u16(reinterpret_cast<uint16x8_t>(v));
#else
  uint16_t all[kHalfLanes];
  Store(all, v);
  uint16_t least = all[0];
  for (int i = 1; i < kHalfLanes; ++i) least = Min(least, all[i]);
  return least;
#endif
}

// The first of the least.
inline int StepOfLeast(const uint16_t* sums, int steps, uint16_t* least) {
  HalfWords step = {}, best = HalfWords{} + kNoSum, best_step = {};
  for (int i = 0; i < kHalfLanes; ++i) step[i] = static_cast<uint16_t>(i);
  for (int i = 0; i < steps; i += kHalfLanes) {
    const HalfWords sum = Load<HalfWords>(sums + i);
    best_step = sum < best ? step : best_step;
    best = Min(best, sum);
    step += static_cast<uint16_t>(kHalfLanes);
  }
  *least = LeastOf(best);
  return LeastOf(best == *least ? best_step : HalfWords{} + kNoSum);
}

inline uint16_t LeastBut(const uint16_t* sums, int steps, int step) {
  constexpr int kAround = 4;
  uint16_t all[kMaxSweepSteps + 2 * kAround];
  __builtin_memcpy(all + kAround, sums, steps * sizeof *sums);
  for (int i = -2; i <= 2; ++i) all[kAround + step + i] = kNoSum;
  HalfWords least = HalfWords{} + kNoSum;
  for (int i = 0; i < steps; i += kHalfLanes)
    least = Min(least, Load<HalfWords>(all + kAround + i));
  return LeastOf(least);
}

inline uint16_t MeanCost(const uint8_t* cost, int steps) {
  uint32_t sum = 0;
  for (int i = 0; i < steps; ++i) sum += cost[i];
  return static_cast<uint16_t>(16 * sum / static_cast<uint32_t>(steps));
}

void Choose(const ChoiceTask& task) {
  for (int x = 0; x < task.width; ++x) {
    const uint16_t* sums = task.sum + static_cast<int64_t>(x) * task.stride;
    StepChoice& out = task.out[x];
    const int step = StepOfLeast(sums, task.steps, &out.least);
    out.step = static_cast<uint8_t>(step);
    out.before = step > 0 ? sums[step - 1] : kNoSum;
    out.after = step + 1 < task.steps ? sums[step + 1] : kNoSum;
    out.second = LeastBut(sums, task.steps, step);
    const uint8_t* cost = task.cost + static_cast<int64_t>(x) * task.stride;
    out.mean = MeanCost(cost, task.steps);
    out.cost = cost[step];
  }
}

// ---- Transposition ----

constexpr int kTile = 16;

inline Block LowHalves(Block a, Block b) {
  return __builtin_shuffle(a, b, Block{0, 16, 1, 17, 2, 18, 3, 19, 4, 20, 5, 21, 6, 22, 7, 23});
}
inline Block HighHalves(Block a, Block b) {
  return __builtin_shuffle(a, b,
                           Block{8, 24, 9, 25, 10, 26, 11, 27, 12, 28, 13, 29, 14, 30, 15, 31});
}

// Four perfect shuffles of sixteen rows turn rows into columns.
inline void Shuffle(const Block (&in)[kTile], Block (&out)[kTile]) {
  for (int i = 0; i < kTile / 2; ++i) {
    out[2 * i] = LowHalves(in[i], in[i + kTile / 2]);
    out[2 * i + 1] = HighHalves(in[i], in[i + kTile / 2]);
  }
}

void Transpose(const TransposeTask& task) {
  for (int x = 0; x < task.width; x += kTile) {
    for (int step = 0; step < task.steps; step += kTile) {
      Block a[kTile], b[kTile];
      for (int i = 0; i < kTile; ++i) a[i] = Load<Block>(task.rows[step + i] + x);
      Shuffle(a, b);
      Shuffle(b, a);
      Shuffle(a, b);
      Shuffle(b, a);
      uint8_t* out = task.out + static_cast<int64_t>(x) * task.steps + step;
      for (int i = 0; i < kTile; ++i) Store(out + static_cast<int64_t>(i) * task.steps, a[i]);
    }
  }
}

SweepKernels MakeKernels() { return {Warp, Census, Paths, Choose, Transpose}; }

}  // namespace
}  // namespace skein
