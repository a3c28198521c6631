#pragma once

#include <Eigen/Core>
#include <functional>
#include <vector>

#include "bundle/bundle_factor.h"
#include "bundle/eliminated_points.h"
#include "bundle/reduced_system.h"

namespace skein {

// Conjugate gradients for (U - W V^-1 W' + diag(damping)) x = b without the matrix W V^-1 W'; the
// points come in parts. Rows that the factor does not know are preconditioned by U's diagonal.
// `for_each`: calls a function for each part, in threads. Returns false if the error has not
// fallen enough in time: the factor is of another system then.
struct ConjugateGradients {
  const ReducedSystem& direct;
  const std::vector<EliminatedPoints>& points;
  const BundleFactor& factor;
  const std::vector<int>& factor_rows;
  std::function<void(const std::function<void(size_t)>&)> for_each;

  bool Solve(const Eigen::VectorXd& damping, const Eigen::VectorXd& b, Eigen::VectorXd* x) const;

 private:
  Eigen::VectorXd Multiply(const Eigen::VectorXd& damping, const Eigen::VectorXd& x) const;
  // `diagonal`: damped
  Eigen::VectorXd Precondition(const Eigen::VectorXd& diagonal, const Eigen::VectorXd& r) const;
};

}  // namespace skein
