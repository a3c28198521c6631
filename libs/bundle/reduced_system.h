#pragma once

#include <Eigen/Core>
#include <memory>

#include "bundle/bundle_terms.h"

namespace skein {

// The symmetric reduced camera system S = U - W V^-1 W' while it is summed up, upper triangle,
// by blocks at the rows of a BundleLayout.
class ReducedSystem {
 public:
  explicit ReducedSystem(int size)
      : gradient(size), schur_gradient(size), diagonal(size), direct_(6, size) {}
  virtual ~ReducedSystem() = default;

  // Adds to U, of which the diagonal is kept apart for the damping.
  template <typename Derived>
  void AddBlock(int row, int column, const Eigen::MatrixBase<Derived>& block) {
    const typename Derived::PlainObject value = block;
    if (row == column) {
      diagonal.segment(row, value.rows()) += value.diagonal();
      if (value.rows() == 6) direct_.middleCols(row, 6) += value;
    }
    Add(row, column, value.data(), value.rows(), value.cols(), 1.0);
  }
  // Subtracts a part of W V^-1 W'.
  template <typename Derived>
  void SubtractBlock(int row, int column, const Eigen::MatrixBase<Derived>& block) {
    const typename Derived::PlainObject value = block;
    Add(row, column, value.data(), value.rows(), value.cols(), -1.0);
  }
  // U's 6 x 6 block of the pose at `row`.
  Eigen::Matrix<double, 6, 6> direct_block(int row) const { return direct_.middleCols<6>(row); }

  void SetZero();
  void Add(const ReducedSystem& other);
  // Solves (S + diag(damping)) x = b by Cholesky; false if it is not positive definite.
  virtual bool Solve(const Eigen::VectorXd& damping, const Eigen::VectorXd& b,
                     Eigen::VectorXd* x) = 0;

  Eigen::VectorXd gradient;        // J' r of the cameras
  Eigen::VectorXd schur_gradient;  // sum of W V^-1 J_p' r
  Eigen::VectorXd diagonal;        // of U

 protected:
  // values: rows x columns, column major
  virtual void Add(int row, int column, const double* values, int rows, int columns,
                   double sign) = 0;
  virtual void SetMatrixZero() = 0;
  virtual void AddMatrix(const ReducedSystem& other) = 0;

 private:
  Eigen::MatrixXd direct_;
};

std::unique_ptr<ReducedSystem> MakeDenseSystem(const BundleLayout& layout);

// Keeps only the blocks of poses that see a point together.
std::unique_ptr<ReducedSystem> MakeSparseSystem(const Bundle& bundle, const BundleLayout& layout);

}  // namespace skein
