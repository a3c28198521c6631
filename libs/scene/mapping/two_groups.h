#pragma once

#include <vector>

namespace skein {

// Least share of the squared deviations from the mean that is left by the means of two groups. A
// value splits the groups, each has three values or more. Photos on false poses come in ones and
// twos. 1 for fewer than six values, where all are equal, and where one is not
// finite.
double ShareLeftByTwoGroups(std::vector<double> values);

// Whether that share is smaller than one normal distribution explains: p < 0.001, by a parametric
// bootstrap. The share has no unit, so the distribution's mean and deviation don't matter. False
// for fewer than seven values.
bool AreTwoGroups(const std::vector<double>& values);

}  // namespace skein
