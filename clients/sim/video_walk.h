// The way of a hand-held video camera through a room, as a function of time.
#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "clients/places/camera.h"

namespace skein::sim {

struct VideoWalk {
  Eigen::Vector2d half_axes_m = {2, 1.4};  // of the ellipse that the camera follows
  double start_m = 0;                      // along it
  double speed_m_s = 0.35;
  uint64_t hand_seed = 1;
};

// Walks 5.5 s, then turns on the spot by 40 degrees and back in 2.5 s, and so on. The hand shakes
// smoothly: up to 8 Hz.
Pose VideoPose(const VideoWalk& walk, double seconds);
// From how far the camera has come after `seconds`, without its hand.
double VideoDistance(const VideoWalk& walk, double seconds);

}  // namespace skein::sim
