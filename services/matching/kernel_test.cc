#include "matching/kernel.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>

namespace skein::kernel_test {

using Descriptors = std::vector<uint8_t>;

constexpr int kNoLimit = 1 << 30;

DescriptorView View(const Descriptors& d) {
  return {d.data(), static_cast<int>(d.size()) / kDescriptorDim};
}

Descriptors Constant(int count, uint8_t value) {
  return Descriptors(static_cast<size_t>(count) * kDescriptorDim, value);
}

// All values are equally likely.
Descriptors Dense(int count, std::mt19937* rng) {
  std::uniform_int_distribution<int> value(0, 48);
  Descriptors d(static_cast<size_t>(count) * kDescriptorDim);
  for (uint8_t& v : d) v = value(*rng);
  return d;
}

// As long as a compact descriptor may be: the squares of dimensions 0, 1, 4, 5, ... and those of
// the others add up to 2^16 - 1. `first` is the first of them.
Descriptors Longest(int count, int first) {
  Descriptors d;
  for (int i = 0; i < count; ++i) {
    Descriptors one = Constant(1, 0);
    for (int k = first, n = 0; n < 7; ++n, k += 4) {
      one[k] = one[k + 2] = std::array<uint8_t, 7>{127, 127, 127, 127, 31, 7, 3}[n];
    }
    d.insert(d.end(), one.begin(), one.end());
  }
  return d;
}

// RootSIFT: the root of a sparse positive vector, of norm 512, made compact.
Descriptors SiftLike(int count, std::mt19937* rng) {
  std::gamma_distribution<double> gamma(0.4, 1.0);
  Descriptors d;
  for (int i = 0; i < count; ++i) {
    double values[kDescriptorDim], sum = 0;
    for (double& v : values) sum += v = gamma(*rng);
    for (double v : values) d.push_back(std::min(255.0, 512 * std::sqrt(v / sum)));
  }
  return CompactDescriptors(std::move(d));
}

// `d` in another order, each value changed by up to `noise`; some dropped, some new.
Descriptors NoisyView(const Descriptors& d, int noise, std::mt19937* rng) {
  std::vector<int> order(d.size() / kDescriptorDim);
  for (size_t i = 0; i < order.size(); ++i) order[i] = i;
  std::shuffle(order.begin(), order.end(), *rng);
  std::uniform_int_distribution<int> change(-noise, noise);
  Descriptors out = SiftLike(17, rng);
  for (size_t i = 0; i < order.size(); i += 1 + i % 3 / 2) {
    for (int k = 0; k < kDescriptorDim; ++k) {
      out.push_back(std::clamp(d[order[i] * kDescriptorDim + k] + change(*rng), 0, 127));
    }
  }
  return out;
}

int DistanceSq(const Descriptors& a, int i, const Descriptors& b, int j) {
  int sum = 0;
  for (int k = 0; k < kDescriptorDim; ++k) {
    const int d = a[i * kDescriptorDim + k] - b[j * kDescriptorDim + k];
    sum += d * d;
  }
  return sum;
}

struct Neighbours {
  int best = -1;
  int64_t best_sq = -1, second_sq = -1;  // -1: none
};

// Nearest of b's for each of a's, by the rules in kernel.h.
std::vector<Neighbours> ReferenceNeighbours(const Descriptors& a, const Descriptors& b) {
  std::vector<Neighbours> all(View(a).count);
  for (int i = 0; i < View(a).count; ++i) {
    Neighbours& n = all[i];
    for (int j = 0; j < View(b).count; ++j) {
      const int64_t d = DistanceSq(a, i, b, j);
      if (n.best < 0 || d < n.best_sq) {
        n.second_sq = n.best_sq;
        n.best_sq = d;
        n.best = j;
      } else if (n.second_sq < 0 || d < n.second_sq) {
        n.second_sq = d;
      }
    }
  }
  return all;
}

bool Passes(const Neighbours& n, const MatchOptions& o) {
  const int64_t ratio_sq = std::llround(o.max_ratio * o.max_ratio * 1e6);
  if (n.best < 0 || n.best_sq > o.max_distance_sq) return false;
  return ratio_sq == 0 || n.second_sq < 0 || n.best_sq * 1000000 < ratio_sq * n.second_sq;
}

class Reference {
 public:
  Reference(const Descriptors& a, const Descriptors& b)
      : forward_(ReferenceNeighbours(a, b)), backward_(ReferenceNeighbours(b, a)) {}

  std::vector<IndexPair> Match(const MatchOptions& o) const {
    std::vector<IndexPair> matches;
    for (int i = 0; i < static_cast<int>(forward_.size()); ++i) {
      if (!Passes(forward_[i], o)) continue;
      const Neighbours& back = backward_[forward_[i].best];
      if (back.best == i && Passes(back, o)) {
        matches.push_back({uint32_t(i), uint32_t(forward_[i].best)});
      }
    }
    return matches;
  }

 private:
  std::vector<Neighbours> forward_, backward_;
};

class Kernel : public testing::TestWithParam<KernelVersion> {
 protected:
  void SetUp() override {
    if (!IsKernelSupported(GetParam())) GTEST_SKIP() << "not supported by this processor";
  }

  size_t ExpectEqualsReference(const Descriptors& a, const Descriptors& b) {
    size_t num_matches = 0;
    const Reference reference(a, b);
    for (const double ratio : {0.8, 0.0, 1.0}) {
      for (const int max_distance_sq : {kNoLimit, MatchOptions().max_distance_sq, 0}) {
        MatchOptions options{ratio, max_distance_sq, GetParam()};
        const auto expected = reference.Match(options);
        EXPECT_EQ(DescriptorMatcher(options).Match(View(a), View(b)), expected)
            << View(a).count << " x " << View(b).count << " ratio " << ratio;
        num_matches = std::max(num_matches, expected.size());
      }
    }
    return num_matches;
  }

  std::mt19937 rng_{12345};
};

TEST_P(Kernel, EqualsReferenceAtCountsThatAreNoMultipleOfTheTile) {
  const int counts[] = {0, 1, 2, 3, 15, 16, 17, 63, 64, 65, 255, 257};
  for (const int n : counts) {
    for (const int m : counts) {
      ExpectEqualsReference(SiftLike(n, &rng_), SiftLike(m, &rng_));
      ExpectEqualsReference(Dense(n, &rng_), Dense(m, &rng_));
    }
  }
}

TEST_P(Kernel, EqualsReferenceOnTwoViewsOfOneScene) {
  const Descriptors a = SiftLike(900, &rng_);
  EXPECT_GT(ExpectEqualsReference(a, NoisyView(a, 6, &rng_)), 500u);
}

// Three parts, one of them larger than a block of rows.
TEST_P(Kernel, ComparesOnlyWhatIsInTheSamePart) {
  const Descriptors a = SiftLike(700, &rng_), b = NoisyView(a, 6, &rng_);
  const auto part_of = [](uint32_t i) { return i % 7 < 4 ? 1u : i % 7 == 4 ? 0u : 2u; };
  std::vector<uint32_t> rows[3], columns[3];
  for (uint32_t i = 0; i < 700; ++i) rows[part_of(i)].push_back(i);
  for (int j = 0; j < View(b).count; ++j) columns[part_of(j * 5)].push_back(j);
  std::vector<ProductPart> parts;
  std::vector<IndexPair> expected;
  const MatchOptions options{0.8, kNoLimit, GetParam()};
  for (int p = 0; p < 3; ++p) {
    parts.push_back(
        {{rows[p].data(), int(rows[p].size())}, {columns[p].data(), int(columns[p].size())}});
    Descriptors part_a, part_b;
    for (const uint32_t i : rows[p]) part_a.insert(part_a.end(), &a[128 * i], &a[128 * i] + 128);
    for (const uint32_t j : columns[p]) part_b.insert(part_b.end(), &b[128 * j], &b[128 * j] + 128);
    for (const IndexPair& pair : Reference(part_a, part_b).Match(options)) {
      expected.push_back({rows[p][pair.first], columns[p][pair.second]});
    }
  }
  std::sort(expected.begin(), expected.end(),
            [](const IndexPair& x, const IndexPair& y) { return x.first < y.first; });
  EXPECT_GT(expected.size(), 100u);
  EXPECT_EQ(DescriptorMatcher(options).MatchParts(View(a), View(b), parts), expected);
}

// Each row once, columns in several parts: a column's nearest is that of all of them.
TEST_P(Kernel, AColumnMayBeInSeveralParts) {
  const Descriptors a = SiftLike(400, &rng_), b = NoisyView(a, 6, &rng_);
  std::vector<uint32_t> rows, columns(View(b).count);
  for (uint32_t i = 0; i < 400; ++i) rows.push_back(i);
  for (size_t j = 0; j < columns.size(); ++j) columns[j] = static_cast<uint32_t>(j);
  const IndexSpan all{columns.data(), int(columns.size())};
  const MatchOptions options{0.8, kNoLimit, GetParam()};
  DescriptorMatcher matcher(options);
  EXPECT_EQ(
      matcher.MatchParts(View(a), View(b), {{{&rows[0], 150}, all}, {{&rows[150], 250}, all}}),
      Reference(a, b).Match(options));
  EXPECT_TRUE(matcher.MatchParts(View(a), View(b), {}).empty());
}

TEST_P(Kernel, EqualsReferenceBeyondOneBlockOfColumns) {
  ExpectEqualsReference(SiftLike(70, &rng_), SiftLike(2 * 256 * 16 + 5, &rng_));
  ExpectEqualsReference(Dense(2 * 256 * 16 + 5, &rng_), Dense(70, &rng_));
}

TEST_P(Kernel, EqualsReferenceAtTheExtremesOfTheRange) {
  for (const int n : {1, 2, 70, 300}) {
    for (const Descriptors& extreme : {Constant(n, 31), Longest(n, 0), Longest(n, 61)}) {
      ExpectEqualsReference(Constant(n, 0), extreme);
      ExpectEqualsReference(extreme, Constant(n, 0));
      ExpectEqualsReference(extreme, extreme);
      ExpectEqualsReference(extreme, Longest(n, 32));
      ExpectEqualsReference(extreme, Dense(n + 1, &rng_));
    }
    ExpectEqualsReference(Constant(n, 0), Constant(n, 0));
    ExpectEqualsReference(Dense(n + 1, &rng_), Constant(n, 0));
  }
}

TEST_P(Kernel, EqualsReferenceWithDuplicates) {
  Descriptors a = SiftLike(300, &rng_);
  Descriptors b = NoisyView(a, 2, &rng_);
  for (const int copies : {1, 2, 33}) {
    for (int i = 0; i < copies; ++i) {
      a.insert(a.end(), a.begin() + 128 * i, a.begin() + 128 * (i + 40));
      b.insert(b.end(), b.begin() + 128 * (5 + i), b.begin() + 128 * (5 + i + 21));
    }
    ExpectEqualsReference(a, b);
  }
}

TEST_P(Kernel, TakesTheLowestIndexOfEquallyNearOnes) {
  const Descriptors one = SiftLike(1, &rng_);
  Descriptors many;
  for (int i = 0; i < 100; ++i) many.insert(many.end(), one.begin(), one.end());
  DescriptorMatcher matcher({0.0, kNoLimit, GetParam()});
  const std::vector<IndexPair> first{{0, 0}};
  EXPECT_EQ(matcher.Match(View(many), View(many)), first);
}

TEST_P(Kernel, DuplicatesFailTheRatioTest) {
  Descriptors a = SiftLike(1, &rng_), b = a;
  b.insert(b.end(), a.begin(), a.end());
  EXPECT_TRUE(DescriptorMatcher({0.8, kNoLimit, GetParam()}).Match(View(a), View(b)).empty());
}

TEST_P(Kernel, TellsTheLargerRatioOfBothDirections) {
  Descriptors a = Constant(1, 10), b = Constant(1, 11);
  a.insert(a.end(), kDescriptorDim, 30);
  b.insert(b.end(), kDescriptorDim, 20);
  const auto matches = DescriptorMatcher({0.8, kNoLimit, GetParam()}).Match(View(a), View(b));
  ASSERT_EQ(matches.size(), 1u);
  EXPECT_FLOAT_EQ(matches[0].ratio_sq, 1.0f / 100);  // 10 to 11 and 20; back, to 10 and 30: 1 / 361
}

TEST_P(Kernel, ALoneNeighbourPassesTheRatioTest) {
  const Descriptors a = Constant(1, 3), b = Constant(1, 9);
  EXPECT_EQ(DescriptorMatcher({0.8, kNoLimit, GetParam()}).Match(View(a), View(b)).size(), 1u);
}

TEST_P(Kernel, OneMatcherServesPairsOfAnySize) {
  DescriptorMatcher matcher({0.8, kNoLimit, GetParam()});
  for (const int n : {500, 3, 0, 40, 700}) {
    const Descriptors a = SiftLike(n, &rng_), b = NoisyView(a, 5, &rng_);
    EXPECT_EQ(matcher.Match(View(a), View(b)), Reference(a, b).Match({0.8, kNoLimit, GetParam()}));
  }
}

TEST_P(Kernel, GivenNormsEqualThoseWorkedOut) {
  const Descriptors a = SiftLike(300, &rng_), b = NoisyView(a, 5, &rng_);
  const auto norms_of = [](const Descriptors& d) {
    std::vector<int32_t> norms;
    for (size_t i = 0; i < d.size(); i += kDescriptorDim) norms.push_back(NormSq(&d[i]));
    return norms;
  };
  const std::vector<int32_t> norms_a = norms_of(a), norms_b = norms_of(b);
  DescriptorView with_a = View(a), with_b = View(b);
  with_a.norm_sq = norms_a.data();
  with_b.norm_sq = norms_b.data();
  DescriptorMatcher matcher({0.8, kNoLimit, GetParam()});
  const auto expected = matcher.Match(View(a), View(b));
  EXPECT_GT(expected.size(), 100u);
  EXPECT_EQ(matcher.Match(with_a, with_b), expected);
  EXPECT_EQ(matcher.Match(with_a, View(b)), expected);
  EXPECT_EQ(matcher.Match(View(a), with_b), expected);
}

TEST_P(Kernel, DotProductsAreExact) {
  for (const auto& a : {Longest(1, 0), Constant(1, 0), Dense(1, &rng_)}) {
    Descriptors b = Dense(40, &rng_);
    for (const Descriptors& more : {Constant(1, 0), Longest(1, 0)}) {
      b.insert(b.end(), more.begin(), more.end());
    }
    const std::vector<uint32_t> indices{41, 3, 3, 40, 0, 17};
    std::vector<int32_t> dots;
    DotProducts(GetParam(), a.data(), b.data(), indices, &dots);
    ASSERT_EQ(dots.size(), indices.size());
    for (size_t i = 0; i < indices.size(); ++i) {
      int32_t expected = 0;
      for (int k = 0; k < kDescriptorDim; ++k) {
        expected += a[k] * b[indices[i] * kDescriptorDim + k];
      }
      EXPECT_EQ(dots[i], expected);
    }
    DotProducts(GetParam(), a.data(), b.data(), {}, &dots);
    EXPECT_TRUE(dots.empty());
  }
}

TEST_P(Kernel, RefusesBrokenInput) {
  DescriptorMatcher matcher({0.8, kNoLimit, GetParam()});
  EXPECT_THROW(matcher.Match({nullptr, 1}, {nullptr, 0}), std::invalid_argument);
  EXPECT_THROW(matcher.Match({nullptr, 0}, {nullptr, -1}), std::invalid_argument);
}

TEST(CompactDescriptors, HaveHalfTheValuesUnlessTheirProductsMayBeTooLarge) {
  EXPECT_EQ(CompactDescriptors(Constant(2, 63)), Constant(2, 31));
  const Descriptors half = Longest(3, 1);
  Descriptors whole = half;
  for (uint8_t& value : whole) value = 2 * value + 1;
  EXPECT_EQ(CompactDescriptors(whole), half);
  whole[kDescriptorDim] = 2;  // of the second descriptor, in place of 1
  Descriptors expected = half;
  std::fill_n(expected.begin() + kDescriptorDim, kDescriptorDim, 0);
  EXPECT_EQ(CompactDescriptors(whole), expected);
}

INSTANTIATE_TEST_SUITE_P(Versions, Kernel, testing::ValuesIn(kKernelVersions),
                         [](const auto& info) { return KernelName(info.param); });

TEST(MatchOptions, RefusesNonsense) {
  MatchOptions options;
  options.max_ratio = 1.5;
  EXPECT_THROW(DescriptorMatcher{options}, std::invalid_argument);
}

}  // namespace skein::kernel_test
