#pragma once

// Mutual nearest neighbours with ratio test over compact descriptors, exact.
//
// All squared distances |a|^2 + |b|^2 - 2ab are integers (<= 262,140), so every version gives
// identical results. Each distance is computed once and serves both directions.
//
// A pair (i, j) matches when all of these hold:
//  - j is the nearest neighbour of i in the second set, and i that of j in the first. Among equally
//    near neighbours the lowest index counts as the nearest.
//  - best^2 < max_ratio^2 * second^2 in both directions, strictly. The second neighbour may be as
//    near as the best, so duplicates never match below ratio 1. A single neighbour (the other set
//    has one descriptor) passes.
//  - distance^2 <= max_distance_sq.

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "core/local_descriptor.h"
#include "core/result.h"

namespace skein {

// Descriptors of seven bits a value and half the norm, from N x 128 uint8, row major: value / 2,
// rounded down. The squares of the dimensions k with k mod 4 < 2 then add up to less than 2^16, and
// so do those of the others. AVX2 can thus add products of two descriptors in 16 bits, twice as
// many at once as in 32. A descriptor beyond that bound becomes zero; RootSIFT never is.
std::vector<uint8_t> CompactDescriptors(std::vector<uint8_t> descriptors);

// count x 128 values of compact descriptors, row major; not owned.
struct DescriptorView {
  const uint8_t* data = nullptr;
  int count = 0;
  const int32_t* norm_sq = nullptr;  // of each; null: worked out for each product
};

// Sum of the squares of a descriptor's 128 values.
int32_t NormSq(const uint8_t* descriptor);

// Equal if the indices are.
struct IndexPair {
  uint32_t first;   // index in the first set
  uint32_t second;  // index in the second set
  // best^2 / second^2, the larger of both directions: the smaller, the surer. 0 without a second
  // neighbour.
  float ratio_sq = 0;

  bool operator==(const IndexPair& other) const {
    return first == other.first && second == other.second;
  }
};

enum class KernelVersion { kPortable, kAvx2, kAvx512Vnni, kAmx, kNeon, kNeonDot };
constexpr std::array<KernelVersion, 6> kKernelVersions = {
    KernelVersion::kPortable, KernelVersion::kAvx2, KernelVersion::kAvx512Vnni,
    KernelVersion::kAmx,      KernelVersion::kNeon, KernelVersion::kNeonDot};
// The slowest first among those of one architecture.

// "portable", "avx2", "avx512vnni", "amx", "neon", "neondot".
std::string KernelName(KernelVersion version);

// Whether this processor and operating system run it. For AMX the operating system is asked for
// permission once, for the whole process.
bool IsKernelSupported(KernelVersion version);

// The fastest one supported here.
KernelVersion FastestKernel();

// dots[k] = product of descriptor a (128 values) with row indices[k] of `descriptors`, all compact.
// Exact: the same for all versions. The version must be supported here.
void DotProducts(KernelVersion version, const uint8_t* a, const uint8_t* descriptors,
                 const std::vector<uint32_t>& indices, std::vector<int32_t>* dots);

struct MatchOptions {
  // Lowe's ratio of Euclidean distances; its square is held to 1e-6. 0 turns the test off.
  double max_ratio = 0.8;

  // Largest squared distance. The default is COLMAP's limit of 0.7 rad between descriptors of norm
  // 256: 2 * 256^2 * (1 - cos 0.7).
  int max_distance_sq = 30822;

  KernelVersion kernel = FastestKernel();

  Status Check() const;
};

// Some descriptors of two sets, by index.
struct IndexSpan {
  const uint32_t* data = nullptr;  // not owned
  int count = 0;
};

// A part of the product of two sets: each of `rows` with each of `columns`.
struct ProductPart {
  IndexSpan rows;     // of the first set
  IndexSpan columns;  // of the second
};

// Holds the working memory (about 6 MB at 8,192 x 8,192), so keep one a thread.
class DescriptorMatcher {
 public:
  explicit DescriptorMatcher(const MatchOptions& options);  // throws std::invalid_argument
  ~DescriptorMatcher();
  DescriptorMatcher(DescriptorMatcher&& other) noexcept;

  // Matches ordered by `first`. Either set may be empty. Throws std::invalid_argument if a count is
  // negative or data is null with a positive count.
  std::vector<IndexPair> Match(const DescriptorView& first, const DescriptorView& second);

  // As if all that is in no part were farther than any. No two descriptors meet in two parts, and
  // the rows and the columns of each part ascend.
  std::vector<IndexPair> MatchParts(const DescriptorView& first, const DescriptorView& second,
                                    const std::vector<ProductPart>& parts);

 private:
  class Workspace;
  MatchOptions options_;
  std::unique_ptr<Workspace> workspace_;
  std::vector<uint32_t> all_;  // 0, 1, ...
};

}  // namespace skein
