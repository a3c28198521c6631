#include "bundle/reduced_system.h"

#include <Eigen/Cholesky>
#include <Eigen/SparseCholesky>
#include <algorithm>

namespace skein {
namespace {

using ConstBlock = Eigen::Map<const Eigen::MatrixXd>;

class DenseSystem : public ExplicitSystem {
 public:
  explicit DenseSystem(int size) : ExplicitSystem(size), S_(size, size) {}

  bool Solve(const Eigen::VectorXd& damping, const Eigen::VectorXd& b,
             Eigen::VectorXd* x) override {
    S_.diagonal() += damping;
    // Column-major upper triangle is the lower one of the transpose, which LLT reads fastest.
    Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>, Eigen::Upper> llt(S_);
    if (llt.info() != Eigen::Success) return false;
    *x = llt.solve(b);
    return x->allFinite();
  }

  // S_ holds the factor U of U' U.
  Eigen::VectorXd SolveAgain(const Eigen::VectorXd& b) const override {
    const auto U = S_.triangularView<Eigen::Upper>();
    return U.solve(U.adjoint().solve(b));
  }

 protected:
  void Add(int row, int column, const double* values, int rows, int columns, double sign) override {
    if (rows == 6 && columns == 6) {
      const Eigen::Map<const Eigen::Matrix<double, 6, 6>> block(values);
      if (sign > 0) {
        S_.block<6, 6>(row, column) += block;
      } else {
        S_.block<6, 6>(row, column) -= block;
      }
      return;
    }
    S_.block(row, column, rows, columns) += sign * ConstBlock(values, rows, columns);
  }
  void SetMatrixZero() override { S_.setZero(); }
  void AddMatrix(const ReducedSystem& other) override {
    S_ += static_cast<const DenseSystem&>(other).S_;
  }

 private:
  Eigen::MatrixXd S_;
};

// Pose blocks in block rows with sorted columns; the cameras' rows, few, as a dense border.
class SparseSystem : public ExplicitSystem {
 public:
  SparseSystem(const PosePattern& pattern, const BundleLayout& layout)
      : ExplicitSystem(layout.size),
        num_pose_rows_(6 * layout.num_free_poses),
        columns_(pattern),
        first_(layout.num_free_poses + 1, 0),
        border_(layout.size, layout.size - num_pose_rows_) {
    for (size_t i = 0; i < columns_.size(); ++i) first_[i + 1] = first_[i] + columns_[i].size();
    blocks_.resize(first_.back());
  }

  bool Solve(const Eigen::VectorXd& damping, const Eigen::VectorXd& b,
             Eigen::VectorXd* x) override {
    const Eigen::SparseMatrix<double> S = Matrix(damping);
    if (!analysed_) llt_.analyzePattern(S);
    analysed_ = true;
    llt_.factorize(S);
    if (llt_.info() != Eigen::Success) return false;
    if (!DecomposeBorder(damping)) return false;
    *x = SolveAgain(b);
    return x->allFinite();
  }

  // [A B; B' C] [x; z] = [b; d] through the Schur complement of A.
  Eigen::VectorXd SolveAgain(const Eigen::VectorXd& b) const override {
    Eigen::VectorXd x(b.size());
    const Eigen::VectorXd A_b = llt_.solve(b.head(num_pose_rows_));
    const int border = static_cast<int>(border_.cols());
    x.head(num_pose_rows_) = A_b;
    if (border == 0) return x;
    const auto B = border_.topRows(num_pose_rows_);
    x.tail(border) = border_llt_.solve(b.tail(border) - B.transpose() * A_b);
    x.head(num_pose_rows_) -= A_B_ * x.tail(border);
    return x;
  }

 protected:
  void Add(int row, int column, const double* values, int rows, int columns, double sign) override {
    if (column >= num_pose_rows_) {
      border_.block(row, column - num_pose_rows_, rows, columns) +=
          sign * ConstBlock(values, rows, columns);
      return;
    }
    const std::vector<int>& in_row = columns_[row / 6];
    const size_t at = std::lower_bound(in_row.begin(), in_row.end(), column / 6) - in_row.begin();
    blocks_[first_[row / 6] + at] += sign * Eigen::Map<const Eigen::Matrix<double, 6, 6>>(values);
  }
  void SetMatrixZero() override {
    for (auto& block : blocks_) block.setZero();
    border_.setZero();
  }
  void AddMatrix(const ReducedSystem& other) override {
    const auto& o = static_cast<const SparseSystem&>(other);
    for (size_t i = 0; i < blocks_.size(); ++i) blocks_[i] += o.blocks_[i];
    border_ += o.border_;
  }

 private:
  Eigen::SparseMatrix<double> Matrix(const Eigen::VectorXd& damping) const {
    std::vector<Eigen::Triplet<double>> entries;
    entries.reserve(36 * blocks_.size());
    for (size_t row = 0; row < columns_.size(); ++row) {
      for (size_t k = 0; k < columns_[row].size(); ++k) {
        const auto& block = blocks_[first_[row] + k];
        const int r0 = 6 * static_cast<int>(row), c0 = 6 * columns_[row][k];
        for (int c = 0; c < 6; ++c) {
          for (int r = 0; r < 6; ++r) {
            if (r0 + r > c0 + c) continue;
            entries.emplace_back(r0 + r, c0 + c,
                                 block(r, c) + (r0 + r == c0 + c ? damping[r0 + r] : 0.0));
          }
        }
      }
    }
    Eigen::SparseMatrix<double> S(num_pose_rows_, num_pose_rows_);
    S.setFromTriplets(entries.begin(), entries.end());
    return S;
  }

  bool DecomposeBorder(const Eigen::VectorXd& damping) {
    const int border = static_cast<int>(border_.cols());
    if (border == 0) return true;
    const Eigen::MatrixXd B = border_.topRows(num_pose_rows_);
    Eigen::MatrixXd C = border_.bottomRows(border);
    C.diagonal() += damping.tail(border);
    C = C.selfadjointView<Eigen::Upper>();
    A_B_ = llt_.solve(B);
    border_llt_.compute(C - B.transpose() * A_B_);
    return border_llt_.info() == Eigen::Success;
  }

  const int num_pose_rows_;
  const PosePattern columns_;  // block columns of each block row
  std::vector<size_t> first_;  // of each row in blocks_
  std::vector<Eigen::Matrix<double, 6, 6>> blocks_;
  Eigen::MatrixXd border_;  // columns of the cameras' parameters
  Eigen::SimplicialLLT<Eigen::SparseMatrix<double>, Eigen::Upper> llt_;
  bool analysed_ = false;
  Eigen::MatrixXd A_B_;  // A^-1 B
  Eigen::LLT<Eigen::MatrixXd> border_llt_;
};

// Opens the numbers of entries in the factor's columns, which the analysis finds.
class AnalysedLlt : public Eigen::SimplicialLLT<Eigen::SparseMatrix<double>, Eigen::Upper> {
 public:
  Eigen::ArrayXd ColumnSizes() const { return m_nonZerosPerCol.array().cast<double>(); }
};

// Multiplications of a Cholesky decomposition with one entry a block.
double NumOperations(const PosePattern& pattern) {
  const int size = static_cast<int>(pattern.size());
  std::vector<Eigen::Triplet<double>> entries;
  for (int row = 0; row < size; ++row) {
    for (const int column : pattern[row]) entries.emplace_back(row, column, 1.0);
  }
  Eigen::SparseMatrix<double> S(size, size);
  S.setFromTriplets(entries.begin(), entries.end());
  AnalysedLlt llt;
  llt.analyzePattern(S);
  return llt.ColumnSizes().square().sum();
}

}  // namespace

void ReducedSystem::SetZero() {
  gradient.setZero();
  schur_gradient.setZero();
  diagonal.setZero();
  direct_.setZero();
  SetMatrixZero();
}

void ReducedSystem::Add(const ReducedSystem& other) {
  gradient += other.gradient;
  schur_gradient += other.schur_gradient;
  diagonal += other.diagonal;
  direct_ += other.direct_;
  AddMatrix(other);
}

std::unique_ptr<ExplicitSystem> MakeDenseSystem(const BundleLayout& layout) {
  return std::make_unique<DenseSystem>(layout.size);
}

PosePattern FindPattern(const Bundle& bundle, const BundleLayout& layout) {
  const int size = layout.num_free_poses;
  std::vector<std::vector<bool>> found(size, std::vector<bool>(size, false));
  for (const BundlePoint& point : bundle.points) {
    for (int i = point.first; i < point.first + point.count; ++i) {
      const int row = layout.pose_row[bundle.observations[i].pose];
      for (int j = point.first; row >= 0 && j < point.first + point.count; ++j) {
        const int column = layout.pose_row[bundle.observations[j].pose];
        if (column >= row) found[row / 6][column / 6] = true;
      }
    }
  }
  PosePattern pattern(size);
  for (int row = 0; row < size; ++row) {
    found[row][row] = true;
    for (int column = row; column < size; ++column) {
      if (found[row][column]) pattern[row].push_back(column);
    }
  }
  return pattern;
}

bool IsFasterSparse(const PosePattern& pattern) {
  constexpr double kSlowness = 5;  // of an operation of SimplicialLLT beside LLT: measured 4 to 6
  const double size = static_cast<double>(pattern.size());
  return kSlowness * NumOperations(pattern) < size * size * size / 3;
}

std::unique_ptr<ExplicitSystem> MakeSparseSystem(const PosePattern& pattern,
                                                 const BundleLayout& layout) {
  return std::make_unique<SparseSystem>(pattern, layout);
}

PosePattern ChoosePattern(const BundleOptions& options, const Bundle& bundle,
                          const BundleLayout& layout) {
  constexpr int kMaxDensePoses = 250, kMaxFilledPoses = 1500;
  if (options.is_always_sparse) return FindPattern(bundle, layout);
  if (layout.num_free_poses <= kMaxDensePoses) return {};
  PosePattern pattern = FindPattern(bundle, layout);
  const bool is_dense = layout.num_free_poses <= kMaxFilledPoses && !IsFasterSparse(pattern);
  return is_dense ? PosePattern() : pattern;
}

std::unique_ptr<ExplicitSystem> MakeSystem(const PosePattern& chosen, const BundleLayout& layout) {
  return chosen.empty() ? MakeDenseSystem(layout) : MakeSparseSystem(chosen, layout);
}

}  // namespace skein
