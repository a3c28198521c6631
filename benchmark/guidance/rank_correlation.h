// How well one quantity tells the order of another.
#pragma once

#include <vector>

namespace skein {

// Spearman's: Pearson's correlation of the ranks, equal values sharing their mean rank. Infinite
// values have ranks, too. 0 for less than three pairs, or where all values of a side are equal.
double SpearmanCorrelation(const std::vector<double>& a, const std::vector<double>& b);

// Area under the receiver operating characteristic: the probability that a score of a positive is
// higher than one of a negative, equal ones counting half. 0.5 where either is missing.
double AreaUnderRoc(const std::vector<double>& scores, const std::vector<bool>& positive);

}  // namespace skein
