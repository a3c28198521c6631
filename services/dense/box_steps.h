// Positions of a chunk as 16-bit steps from the corner of their box.
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

namespace skein {

class BoxSteps {
 public:
  // Not empty.
  explicit BoxSteps(const Eigen::AlignedBox3d& box) : min_(box.min()) {
    // Above 0 for a single point, too.
    const double side = std::max(box.sizes().maxCoeff(), 1e-9 * box.max().norm());
    step_ = side > 0 ? side / kMostSteps : 1;
  }

  double step() const { return step_; }

  // `position`: within the box.
  std::array<uint16_t, 3> Of(const Eigen::Vector3d& position) const {
    std::array<uint16_t, 3> steps{};
    for (int i = 0; i < 3; ++i) {
      steps[i] = static_cast<uint16_t>(std::lround((position[i] - min_[i]) / step_));
    }
    return steps;
  }

 private:
  static constexpr double kMostSteps = 65535;

  const Eigen::Vector3d min_;
  double step_ = 0;
};

}  // namespace skein
