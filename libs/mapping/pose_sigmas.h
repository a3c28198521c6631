#pragma once

#include "bundle/bundle.h"

namespace skein {

// How well a pose is determined: its standard deviations for 1 px of noise, along the worst axis.
struct PoseSigmas {
  double position = 0;  // as a fraction of the median depth of the points it sees
  double rotation_deg = 0;
};

// Standard deviations of poses[0], which must be the bundle's only free pose; infinite where it is
// not determined. Points that are not constant are as uncertain as their observations leave them:
// the points are eliminated from the information. Visits all observations.
PoseSigmas SigmasOfFirstPose(const Bundle& bundle);

}  // namespace skein
