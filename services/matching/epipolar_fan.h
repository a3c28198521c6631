#pragma once

// The features of a photo by the epipolar lines that they lie on. All epipolar lines of a photo
// pass through its epipole, so those near one line are a range of directions from there. Features
// are grouped by their distance from the epipole, as the same distance from a line is a wider angle
// near by (the polar rectification of Pollefeys et al. 1999 orders pixels likewise).

#include <Eigen/Core>
#include <cstdint>
#include <vector>

namespace skein {

class EpipolarFan {
 public:
  // Features of the second photo of x2^T F x1 = 0. F has finite values and is not zero.
  void Build(const std::vector<Eigen::Vector2d>& points2, const Eigen::Matrix3d& F);

  // The features from place 0 on. What lies near one line has neighbouring places.
  const std::vector<uint32_t>& features() const { return features_; }

  // Appends the places of the features with a Sampson error of at most max_error_px from the line
  // of x1, in no order. None where F x1 is no line.
  void Find(const Eigen::Vector2d& x1, double max_error_px, std::vector<uint32_t>* places) const;

 private:
  // Features at distances from min_distance to twice that.
  struct Ring {
    uint32_t begin = 0, end = 0;      // in the arrays below, ordered by direction
    double min_distance_px = 0;       // from the epipole
    double max_back_gradient_sq = 0;  // of |F^T x2|^2, the first two coordinates
  };

  // 0 to pi, of what is seen from the epipole; the fan's middle is at pi / 2.
  double DirectionOf(double dx, double dy) const;
  double DirectionOf(const Eigen::Vector3d& line) const;
  void FindInRange(const Ring& ring, double low, double high, const Eigen::Vector3f& line,
                   float max_error_sq, std::vector<uint32_t>* places) const;

  Eigen::Matrix3d F_;
  Eigen::Vector2d epipole_, middle_;  // middle_: the mean of the features
  double first_direction_ = 0;
  std::vector<Ring> rings_;
  std::vector<double> directions_;
  std::vector<float> x_, y_, back_gradient_sq_;
  std::vector<uint32_t> features_;
};

}  // namespace skein
