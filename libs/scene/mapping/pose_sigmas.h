#pragma once

#include "bundle/bundle.h"

namespace skein {

// How well a pose is determined: standard deviations for 1 px of noise, along the worst axis.
struct PoseSigmas {
  double position = 0;  // as a fraction of the median depth of the points it sees
  // Deviation of the pixel at which the photo sees a point at that depth, largest over the corners
  // of its frame, px. Rotation and position of a lens with a small field of view compensate each
  // other: this tells whether that matters for what the photo shows.
  double frame_px = 0;
};

// Standard deviations of poses[0], which must be the bundle's only free pose; infinite where it is
// not determined. Points that are not constant are as uncertain as their observations leave them:
// the points are eliminated from the information. Visits all observations.
PoseSigmas SigmasOfFirstPose(const Bundle& bundle);

}  // namespace skein
