#pragma once

#include <Eigen/Core>
#include <memory>
#include <vector>

#include "bundle/bundle_terms.h"

namespace skein {

// Accumulates the normal equations of the cameras, U and its right-hand side, by blocks at the rows
// of a BundleLayout: upper triangle. Eliminating the points subtracts a part of U, which the
// subclasses hold.
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
  // U's 6 x 6 block of the pose at `row`.
  Eigen::Matrix<double, 6, 6> direct_block(int row) const { return direct_.middleCols<6>(row); }

  void SetZero();
  void Add(const ReducedSystem& other);

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

// Holds the Schur complement S = U - W V^-1 W' as a matrix, to decompose it (by `num_threads`, if
// dense; the factor does not depend on their number).
class ExplicitSystem : public ReducedSystem {
 public:
  using ReducedSystem::ReducedSystem;

  // Subtracts a part of W V^-1 W'.
  template <typename Derived>
  void SubtractBlock(int row, int column, const Eigen::MatrixBase<Derived>& block) {
    const typename Derived::PlainObject value = block;
    Add(row, column, value.data(), value.rows(), value.cols(), -1.0);
  }
  // Solves (S + diag(damping)) x = b by Cholesky; false if it is not positive definite.
  virtual bool Solve(const Eigen::VectorXd& damping, const Eigen::VectorXd& b,
                     Eigen::VectorXd* x) = 0;
  // The same system with another b. Needs a Solve that gave true, and no change since.
  virtual Eigen::VectorXd SolveAgain(const Eigen::VectorXd& b) const = 0;
  // Frees the matrix beside its factor: nothing but SolveAgain may follow.
  virtual void DropMatrix() = 0;
};

std::unique_ptr<ExplicitSystem> MakeDenseSystem(const BundleLayout& layout, int num_threads);

// For each free pose: itself and the later free poses that share a point with it, ascending.
using PosePattern = std::vector<std::vector<int>>;
PosePattern FindPattern(const Bundle& bundle, const BundleLayout& layout);

// Whether the sparse system's Cholesky takes less time than the dense one's. The sparse factor
// fills up where most photos share points. Sparse Cholesky goes entry by entry, dense Cholesky by
// blocks.
bool IsFasterSparse(const PosePattern& pattern);

// Keeps only the blocks of the pattern.
std::unique_ptr<ExplicitSystem> MakeSparseSystem(const PosePattern& pattern,
                                                 const BundleLayout& layout);

// The pattern of a sparse system, where one is to be preferred; else empty, of a dense one. Dense
// are up to 250 poses, and up to 1,500 where the sparse Cholesky decomposition would take longer:
// these take 325 MB a system, and 650 MB for the factor.
PosePattern ChoosePattern(const BundleOptions& options, const Bundle& bundle,
                          const BundleLayout& layout);
std::unique_ptr<ExplicitSystem> MakeSystem(const PosePattern& chosen, const BundleLayout& layout,
                                           int num_threads);

}  // namespace skein
