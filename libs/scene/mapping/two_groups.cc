#include "mapping/two_groups.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <random>

#include "core/statistics.h"

namespace skein {
namespace {

constexpr size_t kMinValues = 7;
constexpr size_t kMinOfGroup = 3;
// p = (1 + samples as extreme) / (1 + samples), Besag and Clifford, Sequential Monte Carlo
// p-values: ends as soon as p < 0.001 is out of reach.
constexpr int kNumSamples = 9999;
constexpr int kMaxAsExtreme = 8;

}  // namespace

double ShareLeftByTwoGroups(std::vector<double> values) {
  const size_t n = values.size();
  if (n < 2 * kMinOfGroup) return 1;
  const double center = mean(values);
  double total = 0, sum = 0, most = 0;
  for (const double value : values) total += (value - center) * (value - center);
  if (!(total > 0 && std::isfinite(total))) return 1;  // a NaN has no place in an order
  std::sort(values.begin(), values.end());
  for (size_t i = 1; i + kMinOfGroup <= n; ++i) {
    sum += values[i - 1] - center;
    const double size = static_cast<double>(i);
    if (i >= kMinOfGroup) most = std::max(most, sum * sum * (1 / size + 1 / (n - size)));
  }
  return 1 - most / total;
}

bool AreTwoGroups(const std::vector<double>& values) {
  if (values.size() < kMinValues) return false;
  const double share = ShareLeftByTwoGroups(values);
  std::mt19937 random(1);
  std::normal_distribution<double> normal;
  std::vector<double> sample(values.size());
  int num_as_extreme = 0;
  for (int i = 0; i < kNumSamples && num_as_extreme <= kMaxAsExtreme; ++i) {
    for (double& value : sample) value = normal(random);
    if (ShareLeftByTwoGroups(sample) <= share) ++num_as_extreme;
  }
  return num_as_extreme <= kMaxAsExtreme;
}

}  // namespace skein
