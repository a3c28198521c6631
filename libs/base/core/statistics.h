// Small statistics over samples.
#pragma once

#include <vector>

namespace skein {

// The p-th percentile, p in 0..100, linear between the two nearest ranks; 0 of no samples.
// Throws std::invalid_argument for a p outside.
double percentile(std::vector<double> samples, double p);

// The sample of rank n / 2, counted from 0: for an even n the upper one of the two in the middle,
// where percentile(samples, 50) lies between them. 0 of no samples.
double UpperMedian(std::vector<double> samples);

// 0 of no samples.
double mean(const std::vector<double>& samples);

}  // namespace skein
