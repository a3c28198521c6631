#pragma once

// What the matches of two photos say while their focal lengths are not known for certain.

#include <optional>

#include "geometry/two_view_fit.h"

namespace skein {

// The focal length of the second photo over that of the first.
struct FocalRatio {
  double log_ratio = 0;  // beyond that of the focal lengths believed
  double sigma = 0;      // its standard deviation
  // Minus twice the log likelihood ratio of "the ratio is as believed" against "it is free":
  // chi-square of 1 degree of freedom if it is as believed (Wilks 1938). Matches on one plane leave
  // the ratio open and have no evidence.
  double evidence = 0;
};

// By a fit of relative pose, focal lengths and distortion with and without equal ratio. None from
// fewer than 15 matches. `pixels` are verified matches; some outliers may be among them.
std::optional<FocalRatio> EstimateFocalRatio(const PairPixels& pixels,
                                             const TwoViewBeliefs& beliefs);

// Whether a rotation without translation explains verified matches at least as well as an epipolar
// geometry does, with whatever focal lengths and distortion. Decided by the geometric robust
// information criterion (Torr 1998), which charges a model for the dimension that it leaves to each
// match: 2 for a rotation, 3 for an epipolar geometry. The noise is that of the epipolar residuals.
// A plane that a moving camera sees is no rotation: its homography has 8 degrees of freedom, a
// rotation with two focal lengths 5. False for fewer than 15 matches.
bool IsRotation(const PairPixels& pixels, const TwoViewBeliefs& beliefs);

}  // namespace skein
