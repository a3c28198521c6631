#include "core/statistics.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numeric>
#include <stdexcept>

namespace skein {

double percentile(std::vector<double> samples, double p) {
  if (!(p >= 0 && p <= 100)) throw std::invalid_argument("percentile: p must be in 0..100");
  if (samples.empty()) return 0;
  const double rank = p / 100 * static_cast<double>(samples.size() - 1);
  const auto low = static_cast<size_t>(std::floor(rank));
  std::nth_element(samples.begin(), samples.begin() + low, samples.end());
  const double below = samples[low];
  if (low + 1 == samples.size()) return below;
  const double above = *std::min_element(samples.begin() + low + 1, samples.end());
  return below + (rank - static_cast<double>(low)) * (above - below);
}

double UpperMedian(std::vector<double> samples) {
  if (samples.empty()) return 0;
  const auto middle = samples.begin() + static_cast<std::ptrdiff_t>(samples.size() / 2);
  std::nth_element(samples.begin(), middle, samples.end());
  return *middle;
}

double mean(const std::vector<double>& samples) {
  if (samples.empty()) return 0;
  return std::accumulate(samples.begin(), samples.end(), 0.0) / static_cast<double>(samples.size());
}

}  // namespace skein
