#pragma once

#include <Eigen/Core>
#include <vector>

#include "bundle/bundle.h"
#include "bundle/point_terms.h"

namespace skein {

// Couplings of the points that a step eliminates with poses and cameras. A product with W V^-1 W'
// costs as much as there are observations; the matrix costs the sum of the squared track lengths.
class EliminatedPoints {
 public:
  // Empties it, with room for points [range.begin, range.end).
  void Begin(const Bundle& bundle, const PointRange& range);
  // `index`: in the bundle. The point's couplings are set.
  void Add(int index, const PointTerms& point);

  // y -= W V^-1 W' x
  void SubtractSchurProduct(const Eigen::VectorXd& x, Eigen::VectorXd* y) const;
  // Back-substitution for the step `y` of the cameras; returns the decrease of the cost that the
  // linear model promises of the points.
  double Move(const Eigen::VectorXd& y, std::vector<BundlePoint>* points) const;

 private:
  struct Point {
    int index;
    size_t poses_end, cameras_end;
    Eigen::Matrix3d V_inverse;
    Eigen::Vector3d gradient, damping;
  };

  // Calls function(point, W' x) for each point.
  template <typename Function>
  void ForEachPull(const Eigen::VectorXd& x, const Function& function) const;

  std::vector<Eigen::Matrix<double, 6, 3>> poses_;
  std::vector<int> pose_rows_;
  std::vector<Coupling> cameras_;
  std::vector<Point> points_;
};

}  // namespace skein
