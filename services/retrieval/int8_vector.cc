#include "retrieval/int8_vector.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <numeric>

#if defined(__x86_64__)
#include <immintrin.h>
#elif defined(__aarch64__)
#include <arm_neon.h>
#include <sys/auxv.h>
#endif

namespace skein {
namespace {

constexpr float kLargest = 127;
constexpr size_t kHeader = sizeof(float) + sizeof(int32_t);

struct Stored {
  double scale;
  double sum_of_squares;
  const int8_t* q;
};

Stored Read(const void* stored) {
  float scale;
  int32_t sum_of_squares;
  const auto* bytes = static_cast<const char*>(stored);
  std::memcpy(&scale, bytes, sizeof(scale));
  std::memcpy(&sum_of_squares, bytes + sizeof(scale), sizeof(sum_of_squares));
  return {scale, static_cast<double>(sum_of_squares),
          reinterpret_cast<const int8_t*>(bytes + kHeader)};
}

int32_t DotPortable(const int8_t* a, const int8_t* b, size_t n) {
  int32_t sum = 0;
  for (size_t i = 0; i < n; ++i) sum += int32_t{a[i]} * b[i];
  return sum;
}

#if defined(__x86_64__)

__attribute__((target("avx2"))) int32_t DotAvx2(const int8_t* a, const int8_t* b, size_t n) {
  constexpr size_t kLanes = 16;
  __m256i sum = _mm256_setzero_si256();
  size_t i = 0;
  for (; i + kLanes <= n; i += kLanes) {
    const __m128i x = _mm_loadu_si128(reinterpret_cast<const __m128i*>(a + i));
    const __m128i y = _mm_loadu_si128(reinterpret_cast<const __m128i*>(b + i));
    sum =
        _mm256_add_epi32(sum, _mm256_madd_epi16(_mm256_cvtepi8_epi16(x), _mm256_cvtepi8_epi16(y)));
  }
  int32_t lanes[8];
  _mm256_storeu_si256(reinterpret_cast<__m256i*>(lanes), sum);
  return std::accumulate(lanes, lanes + 8, DotPortable(a + i, b + i, n - i));
}

__attribute__((target("avx512f,avx512bw"))) int32_t DotAvx512(const int8_t* a, const int8_t* b,
                                                              size_t n) {
  constexpr size_t kLanes = 32;
  __m512i sum = _mm512_setzero_si512();
  size_t i = 0;
  for (; i + kLanes <= n; i += kLanes) {
    const __m256i x = _mm256_loadu_si256(reinterpret_cast<const __m256i*>(a + i));
    const __m256i y = _mm256_loadu_si256(reinterpret_cast<const __m256i*>(b + i));
    sum =
        _mm512_add_epi32(sum, _mm512_madd_epi16(_mm512_cvtepi8_epi16(x), _mm512_cvtepi8_epi16(y)));
  }
  int32_t lanes[16];
  _mm512_storeu_si512(lanes, sum);
  return std::accumulate(lanes, lanes + 16, DotPortable(a + i, b + i, n - i));
}

#elif defined(__aarch64__)

int32_t DotNeon(const int8_t* a, const int8_t* b, size_t n) {
  constexpr size_t kLanes = 16;
  int32x4_t low = vdupq_n_s32(0), high = low;
  size_t i = 0;
  for (; i + kLanes <= n; i += kLanes) {
    const int8x16_t x = vld1q_s8(a + i), y = vld1q_s8(b + i);
    low = vpadalq_s16(low, vmull_s8(vget_low_s8(x), vget_low_s8(y)));
    high = vpadalq_s16(high, vmull_high_s8(x, y));
  }
  return vaddvq_s32(vaddq_s32(low, high)) + DotPortable(a + i, b + i, n - i);
}

#if !defined(__clang__) || __clang_major__ >= 16  // earlier ones don't know the attribute
#define SKEIN_HAS_NEON_DOT
__attribute__((target("arch=armv8.2-a+dotprod"))) int32_t DotNeonDot(const int8_t* a,
                                                                     const int8_t* b, size_t n) {
  constexpr size_t kLanes = 16;
  int32x4_t sum = vdupq_n_s32(0);
  size_t i = 0;
  for (; i + kLanes <= n; i += kLanes) sum = vdotq_s32(sum, vld1q_s8(a + i), vld1q_s8(b + i));
  return vaddvq_s32(sum) + DotPortable(a + i, b + i, n - i);
}
#endif

#endif

}  // namespace

std::vector<Int8Dot> Int8Dots() {
  std::vector<Int8Dot> versions;
#if defined(__x86_64__)
  if (__builtin_cpu_supports("avx512bw")) versions.push_back(DotAvx512);
  if (__builtin_cpu_supports("avx2")) versions.push_back(DotAvx2);
#elif defined(__aarch64__)
#if defined(SKEIN_HAS_NEON_DOT)
  if ((getauxval(AT_HWCAP) & HWCAP_ASIMDDP) != 0) versions.push_back(DotNeonDot);
#endif
  versions.push_back(DotNeon);
#endif
  versions.push_back(DotPortable);
  return versions;
}

static int32_t Dot(const int8_t* a, const int8_t* b, size_t n) {
  static const Int8Dot fastest = Int8Dots().front();
  return fastest(a, b, n);
}

size_t Int8VectorSize(size_t dim) { return kHeader + dim; }

Int8Vector ToInt8(const float* values, size_t dim) {
  float largest = 0;
  for (size_t i = 0; i < dim; ++i) largest = std::max(largest, std::abs(values[i]));
  const float scale = largest / kLargest;
  Int8Vector stored(Int8VectorSize(dim));
  auto* q = reinterpret_cast<int8_t*>(stored.data() + kHeader);
  for (size_t i = 0; i < dim && scale > 0; ++i) {
    q[i] = static_cast<int8_t>(std::lround(values[i] / scale));
  }
  const int32_t sum_of_squares = Dot(q, q, dim);
  std::memcpy(stored.data(), &scale, sizeof(scale));
  std::memcpy(stored.data() + sizeof(scale), &sum_of_squares, sizeof(sum_of_squares));
  return stored;
}

float Int8DistanceSq(const void* a, const void* b, const void* dim) {
  const Stored x = Read(a);
  const Stored y = Read(b);
  const double dot = Dot(x.q, y.q, *static_cast<const size_t*>(dim));
  const double distance_sq = x.scale * x.scale * x.sum_of_squares +
                             y.scale * y.scale * y.sum_of_squares - 2 * x.scale * y.scale * dot;
  return static_cast<float>(std::max(0.0, distance_sq));
}

}  // namespace skein
