#pragma once

// Included by one file for each instruction set, which is compiled with its -m flags. Everything is
// in an anonymous namespace and nothing of the standard library is called: the linker could use
// inline code of this file elsewhere. Vectors are GCC's and Clang's vector_size; what is not
// written with them are loops that the compiler turns into vectors.

#include "features/sift_kernels.h"

namespace skein {
namespace {

#if defined(__AVX512F__)
constexpr int kLanes = 16;
#elif defined(__AVX2__)
constexpr int kLanes = 8;
#else
constexpr int kLanes = 4;
#endif

typedef float Floats __attribute__((vector_size(4 * kLanes)));
typedef int32_t Ints __attribute__((vector_size(4 * kLanes)));

inline Floats Load(const float* p) {
  Floats v;
  __builtin_memcpy(&v, p, sizeof v);
  return v;
}
inline void Store(float* p, Floats v) { __builtin_memcpy(p, &v, sizeof v); }
inline Floats Min(Floats a, Floats b) { return a < b ? a : b; }
inline Floats Max(Floats a, Floats b) { return a > b ? a : b; }
inline float Min(float a, float b) { return a < b ? a : b; }
inline float Max(float a, float b) { return a > b ? a : b; }
inline int Min(int a, int b) { return a < b ? a : b; }
inline int Max(int a, int b) { return a > b ? a : b; }
inline float Abs(float a) { return a < 0 ? -a : a; }

inline bool Any(Ints mask) {
  int64_t parts[kLanes / 2], any = 0;
  __builtin_memcpy(parts, &mask, sizeof parts);
  for (int i = 0; i < kLanes / 2; ++i) any |= parts[i];
  return any != 0;
}

// ---- Blur ----

// Adds row j of the input to the output rows kFirst..kLast; it is tap j - i of row i.
template <int kFirst, int kLast, int kVectors>
inline void AddRow(const float* row, const float* weights, int j,
                   Floats (&sum)[kBlockRows][kVectors]) {
  Floats in[kVectors];
  for (int v = 0; v < kVectors; ++v) in[v] = Load(row + v * kLanes);
  for (int i = kFirst; i <= kLast; ++i) {
    for (int v = 0; v < kVectors; ++v) sum[i][v] += in[v] * weights[j - i];
  }
}

// Weighted sums of `taps` rows, for four output rows that are one input row apart.
inline void SumRows(const float* const* rows, const float* weights, int taps, int width,
                    float* const* out) {
  constexpr int kVectors = 2;
  for (int x = 0; x < width; x += kVectors * kLanes) {
    Floats sum[kBlockRows][kVectors] = {};
    AddRow<0, 0>(rows[0] + x, weights, 0, sum);
    AddRow<0, 1>(rows[1] + x, weights, 1, sum);
    AddRow<0, 2>(rows[2] + x, weights, 2, sum);
    for (int j = 3; j < taps; ++j) AddRow<0, 3>(rows[j] + x, weights, j, sum);
    AddRow<1, 3>(rows[taps] + x, weights, taps, sum);
    AddRow<2, 3>(rows[taps + 1] + x, weights, taps + 1, sum);
    AddRow<3, 3>(rows[taps + 2] + x, weights, taps + 2, sum);
    for (int i = 0; i < kBlockRows; ++i) {
      for (int v = 0; v < kVectors; ++v) Store(out[i] + x + v * kLanes, sum[i][v]);
    }
  }
}

// Columns beyond the ends repeat those before them, the outermost one excepted.
inline void ReflectColumns(float* row, int width, int count) {
  for (int k = 1; k <= count; ++k) {
    row[-k] = row[Min(k, width - 1)];
    row[width - 1 + k] = row[Max(width - 1 - k, 0)];
  }
}

// Weighted sums of `taps` columns, the first `left` columns to the left.
template <typename Use>
inline void SumColumns(const float* row, const float* weights, int taps, int left, int width,
                       const Use& use) {
  constexpr int kVectors = 4;
  for (int x = 0; x < width; x += kVectors * kLanes) {
    Floats sum[kVectors] = {};
    const float* in = row + x - left;
    for (int k = 0; k < taps; ++k) {
      for (int v = 0; v < kVectors; ++v) sum[v] += Load(in + k + v * kLanes) * weights[k];
    }
    for (int v = 0; v < kVectors; ++v) use(x + v * kLanes, sum[v]);
  }
}

void Blur(const BlurRows& task) {
  float* columns[kBlockRows];
  for (int i = 0; i < kBlockRows; ++i) {
    columns[i] = task.scratch + i * (task.width + 3 * kRowPadding) + kRowPadding;
  }
  const int taps = 2 * task.radius + 1;
  SumRows(task.rows, task.weights, taps, task.width, columns);
  for (int i = 0; i < kBlockRows; ++i) {
    ReflectColumns(columns[i], task.width, task.radius);
    const float* below = task.rows[task.radius + i];
    float* out = task.out[i];
    float* difference = task.difference[i];
    SumColumns(columns[i], task.weights, taps, task.radius, task.width, [&](int x, Floats sum) {
      Store(out + x, sum);
      Store(difference + x, sum - Load(below + x));
    });
  }
}

void DoubleSize(const DoubleRows& task) {
  const int taps = 2 * task.radius + 2;
  const int stride = task.width + 3 * kRowPadding;
  float* column = task.scratch + kRowPadding;
  float* even = column + stride;
  float* odd = even + stride;
  for (int i = 0; i < kBlockRows; ++i) {
    const float* const* rows = task.rows + i / 2;
    const float* weights = i % 2 ? task.odd : task.even;
    for (int x = 0; x < task.width; x += kLanes) {
      Floats sum = {};
      for (int k = 0; k < taps; ++k) sum += Load(rows[k] + x) * weights[k];
      Store(column + x, sum);
    }
    ReflectColumns(column, task.width, task.radius + 1);
    SumColumns(column, task.even, taps, task.radius, task.width,
               [&](int x, Floats sum) { Store(even + x, sum); });
    SumColumns(column, task.odd, taps, task.radius, task.width,
               [&](int x, Floats sum) { Store(odd + x, sum); });
    float* out = task.out[i];
    for (int x = 0; x < task.width; ++x) {
      out[2 * x] = even[x];
      out[2 * x + 1] = odd[x];
    }
  }
}

void Keep(const float* row, int width, LevelPixel* out) {
  for (int x = 0; x < width; ++x) {
    const float value = row[x] * kLevelUnit + 0.5f;
    out[x] = static_cast<LevelPixel>(static_cast<int32_t>(Min(Max(value, 0.f), 65535.f)));
  }
}

// ---- Extrema ----

// Extrema of a column of 3 x 3 values: three rows of three differences of Gaussians.
inline void ColumnExtrema(const ExtremaRow& task, int x, int stride) {
  Floats most[kDogLevels], least[kDogLevels];
  for (int d = 0; d < kDogLevels; ++d) {
    const Floats a = Load(task.rows[d][0] + x);
    const Floats b = Load(task.rows[d][1] + x);
    const Floats c = Load(task.rows[d][2] + x);
    most[d] = Max(Max(a, b), c);
    least[d] = Min(Min(a, b), c);
  }
  for (int l = 0; l < kOctaveLayers; ++l) {
    float* out = task.scratch + 2 * l * stride + kRowPadding + x;
    Store(out, Max(Max(most[l], most[l + 1]), most[l + 2]));
    Store(out + stride, Min(Min(least[l], least[l + 1]), least[l + 2]));
  }
}

int FindExtrema(const ExtremaRow& task, FoundExtremum* found) {
  const int stride = task.last + 3 * kRowPadding;
  for (int x = (task.first - 1) / kLanes * kLanes; x <= task.last; x += kLanes) {
    ColumnExtrema(task, x, stride);
  }
  int count = 0;
  for (int l = 0; l < kOctaveLayers; ++l) {
    const float* most = task.scratch + 2 * l * stride + kRowPadding;
    const float* least = most + stride;
    const float* values = task.rows[l + 1][1];
    for (int x = task.first; x < task.last; x += kLanes) {
      const Floats value = Load(values + x);
      const Floats high = Max(Max(Load(most + x - 1), Load(most + x)), Load(most + x + 1));
      const Floats low = Min(Min(Load(least + x - 1), Load(least + x)), Load(least + x + 1));
      const Ints is_found = ((value >= high) & (value > task.threshold)) |
                            ((value <= low) & (value < -task.threshold));
      if (__builtin_expect(!Any(is_found), 1)) continue;
      for (int i = 0; i < Min(kLanes, task.last - x); ++i) {
        if (is_found[i]) found[count++] = {x + i, l + 1};
      }
    }
  }
  return count;
}

// ---- Directions ----

// exp(x) for x <= 0: (1 + x / 64)^64 would do for weights; this is 2^x by its bits, to 2e-4.
inline float Exp(float x) {
  const float power = Max(x * 1.44269504f, -30.f);
  const int32_t whole = static_cast<int32_t>(power) - 1;
  const float part = power - static_cast<float>(whole);  // 0..2
  const float half = part - 1;                           // -1..1
  const float root =
      1 + half * (0.69314718f +
                  half * (0.24022651f +
                          half * (0.05550411f + half * (0.00961813f + half * 0.00133336f))));
  const int32_t bits = (whole + 1 + 127) << 23;
  float scale;
  __builtin_memcpy(&scale, &bits, sizeof scale);
  return root * scale;
}

// Direction of (x, y) in turns, 0..1, from +x to +y; to 2e-6 (polynomial: Hastings 1955, sheet 12).
inline float Turn(float x, float y) {
  const float ax = Abs(x), ay = Abs(y);
  const float t = Min(ax, ay) / (Max(ax, ay) + 1e-20f);
  const float t2 = t * t;
  float turn =
      t *
      (0.159154943f * 0.99997726f +
       t2 * (0.159154943f * -0.33262347f +
             t2 * (0.159154943f * 0.19354346f +
                   t2 * (0.159154943f * -0.11643287f +
                         t2 * (0.159154943f * 0.05265332f + t2 * (0.159154943f * -0.01172120f))))));
  turn = ay > ax ? 0.25f - turn : turn;
  turn = x < 0 ? 0.5f - turn : turn;
  return y < 0 ? 1 - turn : turn;
}

constexpr int kMaxOrientationRadius = 31;

// Lowe 2004, section 5, with OpenCV's window: a Gaussian of 1.5 sigma, 3 of its deviations wide.
void Orientations(const KeypointPatch& patch, float* histogram) {
  constexpr int kMaxColumns = 2 * kMaxOrientationRadius + 2;
  const float deviation = 1.5f * patch.sigma;
  const int radius = Min(static_cast<int>(3 * deviation + 0.5f), kMaxOrientationRadius);
  const int x = static_cast<int>(patch.x + 0.5f), y = static_cast<int>(patch.y + 0.5f);
  const int left = Max(x - radius, 1), right = Min(x + radius, patch.width - 2);
  const int top = Max(y - radius, 1), bottom = Min(y + radius, patch.height - 2);
  const int columns = right - left + 1;
  const float scale = -0.5f / (deviation * deviation);
  float weights[kMaxColumns], amounts[kMaxColumns];
  int32_t bins[kMaxColumns];
  for (int i = 0; i < columns; ++i) {
    const float dx = static_cast<float>(left + i - x);
    weights[i] = Exp(scale * dx * dx);
  }
  float sums[2][kOrientationBins + 1] = {};
  for (int row = top; row <= bottom; ++row) {
    const LevelPixel* at = patch.pixels + static_cast<int64_t>(row) * patch.stride + left;
    const LevelPixel* above = at - patch.stride;
    const LevelPixel* below = at + patch.stride;
    const float dy = static_cast<float>(row - y);
    const float row_weight = Exp(scale * dy * dy);
    for (int i = 0; i < columns; ++i) {
      const float gx = static_cast<float>(at[i + 1] - at[i - 1]);
      const float gy = static_cast<float>(below[i] - above[i]);
      bins[i] = static_cast<int32_t>(kOrientationBins * Turn(gx, gy) + 0.5f);
      amounts[i] = row_weight * weights[i] * __builtin_sqrtf(gx * gx + gy * gy);
    }
    int i = 0;
    for (; i + 1 < columns; i += 2) {
      sums[0][bins[i]] += amounts[i];
      sums[1][bins[i + 1]] += amounts[i + 1];
    }
    if (i < columns) sums[0][bins[i]] += amounts[i];
  }
  for (int b = 0; b < kOrientationBins; ++b) histogram[b] = sums[0][b] + sums[1][b];
  histogram[0] += sums[0][kOrientationBins] + sums[1][kOrientationBins];
}

// ---- Descriptor ----

// The window is 5 cells wide: 4 and half of one to each side, where the weight falls to 0. Samples
// of the window: kSamples x kSamples.
constexpr int kCells = 4;
constexpr int kBins = 8;
constexpr int kSamples = 16;
constexpr float kWindowCells = kCells + 1;

// Weights of a sample's row (or column) for the cells: linear to the cells beside it, times the
// window's Gaussian of half the 4 cells.
struct CellWeights {
  float of[kSamples][kCells];

  CellWeights() {
    for (int i = 0; i < kSamples; ++i) {
      const float at = Place(i);
      for (int c = 0; c < kCells; ++c) {
        const float distance = Abs(at - (static_cast<float>(c) - 1.5f));
        of[i][c] = distance < 1 ? (1 - distance) * Exp(-at * at / 8) : 0;
      }
    }
  }
  // In cells from the keypoint.
  static float Place(int i) {
    return (static_cast<float>(i) + 0.5f - 0.5f * kSamples) * (kWindowCells / kSamples);
  }
};

struct SampleRow {
  float amount[kSamples];  // length of the gradient
  float bin[kSamples];     // its direction, 0..8
};

inline float Bilinear(float a, float b, float c, float d, float fx, float fy) {
  const float top = a + fx * (b - a), bottom = c + fx * (d - c);
  return top + fy * (bottom - top);
}

// Gradients at places x, y of the level, relative to the keypoint's direction.
inline void SampleGradients(const KeypointPatch& patch, const float* x, const float* y,
                            float cosine, float sine, SampleRow* out) {
  float fx[kSamples], fy[kSamples], inside[kSamples];
  int32_t offset[kSamples];
  const float last_x = static_cast<float>(patch.width) - 2.001f;
  const float last_y = static_cast<float>(patch.height) - 2.001f;
  for (int i = 0; i < kSamples; ++i) {
    const float cx = Min(Max(x[i], 1.f), last_x), cy = Min(Max(y[i], 1.f), last_y);
    inside[i] = cx == x[i] && cy == y[i] ? 1.f : 0.f;
    const int32_t ix = static_cast<int32_t>(cx), iy = static_cast<int32_t>(cy);
    fx[i] = cx - static_cast<float>(ix);
    fy[i] = cy - static_cast<float>(iy);
    offset[i] = iy * patch.stride + ix;
  }
  // The 12 pixels around a place: p[row][column], without the corners.
  LevelPixel p[4][4][kSamples];
  for (int i = 0; i < kSamples; ++i) {
    const LevelPixel* at = patch.pixels + offset[i];
    for (int row = 0; row < 4; ++row) {
      const LevelPixel* from = at + (row - 1) * static_cast<int64_t>(patch.stride) - 1;
      for (int column = 0; column < 4; ++column) p[row][column][i] = from[column];
    }
  }
  for (int i = 0; i < kSamples; ++i) {
    const auto v = [&](int row, int column) { return static_cast<float>(p[row][column][i]); };
    const float gx = Bilinear(v(1, 2) - v(1, 0), v(1, 3) - v(1, 1), v(2, 2) - v(2, 0),
                              v(2, 3) - v(2, 1), fx[i], fy[i]);
    const float gy = Bilinear(v(2, 1) - v(0, 1), v(2, 2) - v(0, 2), v(3, 1) - v(1, 1),
                              v(3, 2) - v(1, 2), fx[i], fy[i]);
    const float along = cosine * gx + sine * gy, across = cosine * gy - sine * gx;
    out->amount[i] = inside[i] * __builtin_sqrtf(gx * gx + gy * gy);
    // Bins run counterclockwise, as OpenCV's.
    out->bin[i] = kBins * (1 - Turn(along, across));
  }
}

void Describe(const KeypointPatch& patch, float* descriptor) {
  static const CellWeights weights;
  const float cell = 3 * patch.sigma;
  const float cosine = __builtin_cosf(patch.angle_rad), sine = __builtin_sinf(patch.angle_rad);
  // By row of cells, column of samples and bin.
  float sums[kCells][kSamples][kBins] = {};
  for (int row = 0; row < kSamples; ++row) {
    const float v = cell * CellWeights::Place(row);
    float x[kSamples], y[kSamples];
    for (int i = 0; i < kSamples; ++i) {
      const float u =
          cell * ((static_cast<float>(i) + 0.5f - 0.5f * kSamples) * (kWindowCells / kSamples));
      x[i] = patch.x + cosine * u - sine * v;
      y[i] = patch.y + sine * u + cosine * v;
    }
    SampleRow samples;
    SampleGradients(patch, x, y, cosine, sine, &samples);
    float amounts[kSamples * kBins];
    for (int i = 0; i < kSamples; ++i) {
      for (int b = 0; b < kBins; ++b) {
        const float distance = Abs(samples.bin[i] - static_cast<float>(b));
        const float around = Min(distance, kBins - distance);
        amounts[i * kBins + b] = samples.amount[i] * Max(1 - around, 0.f);
      }
    }
    for (int c = 0; c < kCells; ++c) {
      const float weight = weights.of[row][c];
      if (weight == 0) continue;
      float* sum = sums[c][0];
      for (int k = 0; k < kSamples * kBins; ++k) sum[k] += weight * amounts[k];
    }
  }
  for (int r = 0; r < kCells; ++r) {
    for (int c = 0; c < kCells; ++c) {
      float sum[kBins] = {};
      for (int i = 0; i < kSamples; ++i) {
        for (int b = 0; b < kBins; ++b) sum[b] += weights.of[i][c] * sums[r][i][b];
      }
      for (int b = 0; b < kBins; ++b) descriptor[(r * kCells + c) * kBins + b] = sum[b];
    }
  }
}

SiftKernels MakeKernels() { return {Blur, DoubleSize, FindExtrema, Keep, Orientations, Describe}; }

}  // namespace
}  // namespace skein
