// Small statistics over samples.
#pragma once

#include <vector>

namespace skein {

// The p-th percentile, p in 0..100, linear between the two nearest ranks; 0 of no samples.
// Throws std::invalid_argument for a p outside.
double percentile(std::vector<double> samples, double p);

// 0 of no samples.
double mean(const std::vector<double>& samples);

}  // namespace skein
