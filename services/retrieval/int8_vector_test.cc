#include "retrieval/int8_vector.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

namespace skein::int8_vector_test {

// Half a step of each vector a value, at most.
double RoundingError(const std::vector<float>& a, const std::vector<float>& b) {
  const auto largest = [](const std::vector<float>& v) {
    double max = 0;
    for (const float x : v) max = std::max(max, std::abs(double{x}));
    return max;
  };
  return (largest(a) + largest(b)) / 127 / 2 * std::sqrt(static_cast<double>(a.size()));
}

TEST(Int8Vector, DistancesAreRightButForRoundingInAnyDimension) {
  std::mt19937 random(11);
  std::normal_distribution<float> normal;
  for (const size_t dim : {1, 15, 16, 31, 32, 33, 100, 1024}) {
    std::vector<float> a(dim), b(dim);
    double expected = 0;
    for (size_t i = 0; i < dim; ++i) {
      a[i] = normal(random);
      b[i] = normal(random);
      expected += std::pow(double{a[i]} - double{b[i]}, 2);
    }
    const double distance =
        std::sqrt(Int8DistanceSq(ToInt8(a.data(), dim).data(), ToInt8(b.data(), dim).data(), &dim));
    EXPECT_NEAR(distance, std::sqrt(expected), RoundingError(a, b) + 1e-5) << dim;
  }
}

TEST(Int8Vector, AllVersionsForAllProcessorsGiveTheSame) {
  std::mt19937 random(3);
  for (const size_t n : {0, 1, 16, 31, 32, 63, 64, 1000}) {
    std::vector<int8_t> a(n), b(n);
    for (size_t i = 0; i < n; ++i) {
      a[i] = static_cast<int8_t>(random() % 255);
      b[i] = static_cast<int8_t>(random() % 255);
    }
    int32_t expected = 0;
    for (size_t i = 0; i < n; ++i) expected += int{a[i]} * int{b[i]};
    for (const Int8Dot dot : Int8Dots()) EXPECT_EQ(dot(a.data(), b.data(), n), expected) << n;
  }
}

#if defined(__aarch64__)
TEST(Int8Vector, ArmHasAVectorVersion) { EXPECT_GE(Int8Dots().size(), 2u); }
#endif

// The largest values there are, all of one sign: sums must not overflow in any version.
TEST(Int8Vector, LargestValuesDoNotOverflow) {
  const size_t dim = 4099;
  const std::vector<float> a(dim, 1.f), b(dim, -1.f);
  const auto x = ToInt8(a.data(), dim);
  const auto y = ToInt8(b.data(), dim);
  EXPECT_NEAR(Int8DistanceSq(x.data(), y.data(), &dim), 4. * dim, 0.1);
  EXPECT_EQ(Int8DistanceSq(x.data(), x.data(), &dim), 0);
}

TEST(Int8Vector, ZeroHasALength) {
  const size_t dim = 3;
  const float zero[] = {0, 0, 0};
  const float two[] = {0, 2, 0};
  EXPECT_FLOAT_EQ(Int8DistanceSq(ToInt8(zero, dim).data(), ToInt8(two, dim).data(), &dim), 4);
}

}  // namespace skein::int8_vector_test
