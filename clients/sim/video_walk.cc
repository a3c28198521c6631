#include "clients/sim/video_walk.h"

#include <algorithm>
#include <cmath>

#include "clients/places/random.h"

namespace skein::sim {
namespace {

using Eigen::Vector3d;

constexpr double kWalkS = 5.5, kTurnS = 2.5;
constexpr double kHalfTurn = 20 * kDegree;
constexpr double kCameraHeightM = 1.5;

// A sway of about 1, and a tremor.
double Shake(double seconds, Random random) {
  double sum = 0;
  for (const auto& [hertz, size] : {std::pair(0.37, 0.8), {1.1, 0.5}, {2.9, 0.17}, {8.0, 0.035}}) {
    sum += size * std::sin(2 * M_PI * (hertz * seconds * random.Uniform(0.9, 1.1) + random.Unit()));
  }
  return sum;
}

// To the left and back, in the next turn to the right.
double TurnAt(double seconds) {
  const double cycle = std::floor(seconds / (kWalkS + kTurnS));
  const double turning_s = std::max(0.0, seconds - cycle * (kWalkS + kTurnS) - kWalkS);
  const double sign = std::fmod(cycle, 2) == 0 ? 1 : -1;
  return sign * kHalfTurn * (1 - std::cos(2 * M_PI * turning_s / kTurnS));
}

}  // namespace

double VideoDistance(const VideoWalk& walk, double seconds) {
  const double cycle = std::floor(seconds / (kWalkS + kTurnS));
  const double walking_s = std::min(kWalkS, seconds - cycle * (kWalkS + kTurnS));
  return walk.speed_m_s * (cycle * kWalkS + walking_s);
}

Pose VideoPose(const VideoWalk& walk, double seconds) {
  const Random hand(walk.hand_seed);
  const auto shake = [&](int axis) { return Shake(seconds, hand.Fork(axis)); };
  const double along = walk.start_m + VideoDistance(walk, seconds);
  const double angle = along / walk.half_axes_m.mean();
  const Vector3d sway(0.012 * shake(0), 0.012 * shake(1), 0.01 * shake(2));
  const Vector3d center = Vector3d(walk.half_axes_m.x() * std::cos(angle),
                                   walk.half_axes_m.y() * std::sin(angle), kCameraHeightM) +
                          sway;
  const double heading =
      angle + (80 + 40 * std::sin(along / 1.7) + 1.1 * shake(3)) * kDegree + TurnAt(seconds);
  const double pitch = (-7 + 6 * std::sin(along / 2.3) + 1.0 * shake(4)) * kDegree;
  const Vector3d forward(std::cos(heading), std::sin(heading), std::tan(pitch));
  return LookAt(center, center + forward, 1.0 * kDegree * shake(5));
}

}  // namespace skein::sim
