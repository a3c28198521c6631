#pragma once

#include <Eigen/Core>
#include <memory>
#include <vector>

#include "bundle/bundle_terms.h"

namespace skein {

using Matrix6d = Eigen::Matrix<double, 6, 6>;

// The normal equations of the cameras, U x = gradient, at the rows of a BundleLayout. U has a block
// on the diagonal for each free pose and each camera, and one for each pose with its camera.
class ReducedSystem {
 public:
  explicit ReducedSystem(const BundleLayout& layout);

  // U's 6 x 6 block of the pose at `row`.
  Eigen::Map<Matrix6d> pose_block(int row) { return Eigen::Map<Matrix6d>(&poses_(0, row)); }
  Eigen::Map<const Matrix6d> pose_block(int row) const {
    return Eigen::Map<const Matrix6d>(&poses_(0, row));
  }
  // U's block of the camera at `row` with `size` parameters, full.
  auto camera_block(int row, int size) {
    return cameras_.block(0, row - num_pose_rows_, size, size);
  }
  // U's block of the pose at `row` with its camera: 6 x `size`.
  auto cross_block(int row, int size) { return cross_[row / 6].leftCols(size); }
  Eigen::VectorXd Diagonal() const;

  void SetZero();
  void Add(const ReducedSystem& other);
  // y += U x
  void AddProduct(const Eigen::VectorXd& x, Eigen::VectorXd* y) const;

  Eigen::VectorXd gradient;        // J' r of the cameras
  Eigen::VectorXd schur_gradient;  // sum of W V^-1 J_p' r

 protected:
  int num_pose_rows() const { return num_pose_rows_; }
  // U's columns of the cameras.
  Eigen::MatrixXd Border() const;

 private:
  struct Rows {
    int first = 0, size = 0;  // none: size 0
  };

  const int num_pose_rows_;
  Eigen::MatrixXd poses_;    // 6 rows: each block at its columns
  Eigen::MatrixXd cameras_;  // kMaxIntrinsics rows, likewise
  std::vector<Eigen::Matrix<double, 6, kMaxIntrinsics>> cross_;  // by free pose
  std::vector<Rows> camera_rows_;     // of the cameras with refined parameters
  std::vector<Rows> camera_of_pose_;  // by free pose
};

// For each free pose: itself and the later free poses that share a point with it, ascending.
using PosePattern = std::vector<std::vector<int>>;
PosePattern FindPattern(const Bundle& bundle, const BundleLayout& layout);

// The sum of W V^-1 W', upper triangle, which eliminating the points subtracts from U: 6 x 6 blocks
// of the poses, one after the other in memory, and the columns of the cameras, few, as a border.
class SchurBlocks {
 public:
  // `pattern`: empty if there may be a block at any two poses.
  SchurBlocks(const PosePattern& pattern, const BundleLayout& layout);

  // The block of two poses, row <= column.
  Matrix6d& pose_block(int row, int column) { return blocks_[IndexOf(row / 6, column / 6)]; }
  // A block at a camera's column.
  auto border_block(int row, int column, int rows, int columns) {
    return border_.block(row, column - num_pose_rows_, rows, columns);
  }
  // Calls function(row, column, block) for the poses' blocks: the first row and column of each.
  template <typename Function>
  void ForEach(const Function& function) const {
    for (int i = 0; i < num_poses_; ++i) {
      for (size_t k = 0; k < NumColumns(i); ++k) {
        const int j = columns_.empty() ? i + static_cast<int>(k) : columns_[i][k];
        function(6 * i, 6 * j, blocks_[first_[i] + k]);
      }
    }
  }
  const Eigen::MatrixXd& border() const { return border_; }
  size_t size() const { return blocks_.size(); }

  void SetZero();
  void Add(const SchurBlocks& other);
  // Frees the poses' blocks: nothing may follow.
  void DropPoses() { blocks_ = {}; }

 private:
  size_t NumColumns(int i) const {
    return columns_.empty() ? static_cast<size_t>(num_poses_ - i) : columns_[i].size();
  }
  size_t IndexOf(int i, int j) const;

  const int num_poses_, num_pose_rows_;
  const PosePattern columns_;  // block columns of each block row, ascending
  std::vector<size_t> first_;  // of each row in blocks_
  std::vector<Matrix6d> blocks_;
  Eigen::MatrixXd border_;
};

// The Schur complement S = U - W V^-1 W' as a matrix, to decompose it (by `num_threads`, if dense;
// the factor does not depend on their number).
class ExplicitSystem : public ReducedSystem {
 public:
  ExplicitSystem(const PosePattern& pattern, const BundleLayout& layout)
      : ReducedSystem(layout), schur_(pattern, layout) {}
  virtual ~ExplicitSystem() = default;

  SchurBlocks& schur() { return schur_; }
  void SetZero();
  void Add(const ExplicitSystem& other);
  // Solves (S + diag(damping)) x = b by Cholesky; false if it is not positive definite.
  virtual bool Solve(const Eigen::VectorXd& damping, const Eigen::VectorXd& b,
                     Eigen::VectorXd* x) = 0;
  // The same system with another b. Needs a Solve that gave true, and no change since.
  virtual Eigen::VectorXd SolveAgain(const Eigen::VectorXd& b) const = 0;
  // Frees the matrix beside its factor: nothing but SolveAgain may follow.
  void DropMatrix() { schur_.DropPoses(); }

 protected:
  // Calls function(row, column, block) for S's blocks of the poses.
  template <typename Function>
  void ForEachPoseBlock(const Function& function) const {
    schur_.ForEach([&](int row, int column, const Matrix6d& block) {
      function(row, column, row == column ? Matrix6d(pose_block(row) - block) : Matrix6d(-block));
    });
  }
  size_t num_pose_blocks() const { return schur_.size(); }
  // S's columns of the cameras.
  Eigen::MatrixXd SchurBorder() const { return Border() - schur_.border(); }

 private:
  SchurBlocks schur_;
};

std::unique_ptr<ExplicitSystem> MakeDenseSystem(const BundleLayout& layout, int num_threads);

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
