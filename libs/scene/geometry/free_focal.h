#pragma once

// Relation of two photos by their matches, while their focal lengths are not known for certain.

#include "geometry/two_view_fit.h"

namespace skein {

// Whether a rotation without translation explains verified matches at least as well as an epipolar
// geometry does, with whatever focal lengths and distortion. Decided by the geometric robust
// information criterion (Torr 1998), which charges a model for the dimension that it leaves to each
// match: 2 for a rotation, 3 for an epipolar geometry. The noise is that of the epipolar residuals.
// A plane that a moving camera sees is no rotation: its homography has 8 degrees of freedom, a
// rotation with two focal lengths 5. False for fewer than 15 matches.
bool IsRotation(const PairPixels& pixels, const TwoViewBeliefs& beliefs);

}  // namespace skein
