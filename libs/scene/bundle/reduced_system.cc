#include "bundle/reduced_system.h"

#include <Eigen/Cholesky>
#include <Eigen/SparseCholesky>
#include <algorithm>
#include <cstdint>

#include "bundle/dense_factor.h"

namespace skein {
namespace {

using ConstBlock = Eigen::Map<const Eigen::MatrixXd>;

// Upper triangle by blocks: 6 x 6 of the poses, one after the other in memory, and the columns of
// the cameras, few, as a border. `pattern`: empty if there may be a block at any two poses.
class PoseBlocks {
 public:
  PoseBlocks(const PosePattern& pattern, const BundleLayout& layout)
      : num_poses_(layout.num_free_poses),
        num_pose_rows_(6 * num_poses_),
        columns_(pattern),
        first_(num_poses_ + 1, 0),
        border_(layout.size, layout.size - num_pose_rows_) {
    for (int i = 0; i < num_poses_; ++i) first_[i + 1] = first_[i] + NumColumns(i);
    blocks_.resize(first_.back());
  }

  void Add(int row, int column, const double* values, int rows, int columns, double sign) {
    if (column >= num_pose_rows_) {
      border_.block(row, column - num_pose_rows_, rows, columns) +=
          sign * ConstBlock(values, rows, columns);
      return;
    }
    const Eigen::Map<const Matrix6d> block(values);
    if (sign > 0) {
      blocks_[IndexOf(row / 6, column / 6)] += block;
    } else {
      blocks_[IndexOf(row / 6, column / 6)] -= block;
    }
  }
  void SetZero() {
    for (Matrix6d& block : blocks_) block.setZero();
    border_.setZero();
  }
  void Add(const PoseBlocks& other) {
    for (size_t i = 0; i < blocks_.size(); ++i) blocks_[i] += other.blocks_[i];
    border_ += other.border_;
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
  void DropPoses() { blocks_ = {}; }
  size_t size() const { return blocks_.size(); }
  int num_pose_rows() const { return num_pose_rows_; }
  const Eigen::MatrixXd& border() const { return border_; }

 private:
  using Matrix6d = Eigen::Matrix<double, 6, 6>;

  size_t NumColumns(int i) const {
    return columns_.empty() ? static_cast<size_t>(num_poses_ - i) : columns_[i].size();
  }
  size_t IndexOf(int i, int j) const {
    if (columns_.empty()) return first_[i] + (j - i);
    return first_[i] +
           (std::lower_bound(columns_[i].begin(), columns_[i].end(), j) - columns_[i].begin());
  }

  const int num_poses_, num_pose_rows_;
  const PosePattern columns_;  // block columns of each block row, ascending
  std::vector<size_t> first_;  // of each row in blocks_
  std::vector<Matrix6d> blocks_;
  Eigen::MatrixXd border_;
};

class BlockSystem : public ExplicitSystem {
 public:
  BlockSystem(const PosePattern& pattern, const BundleLayout& layout)
      : ExplicitSystem(layout.size), blocks_(pattern, layout) {}

  void DropMatrix() override { blocks_.DropPoses(); }

 protected:
  void Add(int row, int column, const double* values, int rows, int columns, double sign) override {
    blocks_.Add(row, column, values, rows, columns, sign);
  }
  void SetMatrixZero() override { blocks_.SetZero(); }
  void AddMatrix(const ReducedSystem& other) override {
    blocks_.Add(static_cast<const BlockSystem&>(other).blocks_);
  }
  const PoseBlocks& blocks() const { return blocks_; }

 private:
  PoseBlocks blocks_;
};

class DenseSystem : public BlockSystem {
 public:
  DenseSystem(const BundleLayout& layout, int num_threads)
      : BlockSystem({}, layout), num_threads_(num_threads) {}

  bool Solve(const Eigen::VectorXd& damping, const Eigen::VectorXd& b,
             Eigen::VectorXd* x) override {
    U_.resize(b.size(), b.size());
    blocks().ForEach([this](int row, int column, const Eigen::Matrix<double, 6, 6>& block) {
      U_.block<6, 6>(row, column) = block;
    });
    U_.rightCols(blocks().border().cols()) = blocks().border();
    U_.diagonal() += damping;
    if (!DecomposeDense(num_threads_, &U_)) return false;
    *x = SolveAgain(b);
    return x->allFinite();
  }

  Eigen::VectorXd SolveAgain(const Eigen::VectorXd& b) const override {
    return SolveDense(num_threads_, U_, b);
  }

 private:
  const int num_threads_;
  Eigen::MatrixXd U_;  // factor U' U, after Solve
};

class SparseSystem : public BlockSystem {
 public:
  using BlockSystem::BlockSystem;

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
    const int num_pose_rows = blocks().num_pose_rows();
    const Eigen::VectorXd A_b = llt_.solve(b.head(num_pose_rows));
    const int border = static_cast<int>(blocks().border().cols());
    x.head(num_pose_rows) = A_b;
    if (border == 0) return x;
    const auto B = blocks().border().topRows(num_pose_rows);
    x.tail(border) = border_llt_.solve(b.tail(border) - B.transpose() * A_b);
    x.head(num_pose_rows) -= A_B_ * x.tail(border);
    return x;
  }

 private:
  Eigen::SparseMatrix<double> Matrix(const Eigen::VectorXd& damping) const {
    std::vector<Eigen::Triplet<double>> entries;
    entries.reserve(36 * blocks().size());
    blocks().ForEach([&](int row, int column, const Eigen::Matrix<double, 6, 6>& block) {
      for (int c = 0; c < 6; ++c) {
        for (int r = 0; r < 6 && row + r <= column + c; ++r) {
          const bool is_diagonal = row + r == column + c;
          entries.emplace_back(row + r, column + c,
                               block(r, c) + (is_diagonal ? damping[row + r] : 0.0));
        }
      }
    });
    Eigen::SparseMatrix<double> S(blocks().num_pose_rows(), blocks().num_pose_rows());
    S.setFromTriplets(entries.begin(), entries.end());
    return S;
  }

  bool DecomposeBorder(const Eigen::VectorXd& damping) {
    const int border = static_cast<int>(blocks().border().cols());
    if (border == 0) return true;
    const Eigen::MatrixXd B = blocks().border().topRows(blocks().num_pose_rows());
    Eigen::MatrixXd C = blocks().border().bottomRows(border);
    C.diagonal() += damping.tail(border);
    C = C.selfadjointView<Eigen::Upper>();
    A_B_ = llt_.solve(B);
    border_llt_.compute(C - B.transpose() * A_B_);
    return border_llt_.info() == Eigen::Success;
  }

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

std::unique_ptr<ExplicitSystem> MakeDenseSystem(const BundleLayout& layout, int num_threads) {
  return std::make_unique<DenseSystem>(layout, num_threads);
}

PosePattern FindPattern(const Bundle& bundle, const BundleLayout& layout) {
  constexpr int kBits = 64;
  const int size = layout.num_free_poses, num_words = (size + kBits - 1) / kBits;
  std::vector<uint64_t> found(static_cast<size_t>(size) * num_words), seen(num_words);
  const auto set = [](int i, uint64_t* words) { words[i / kBits] |= uint64_t{1} << i % kBits; };
  std::vector<int> poses;  // that observe the point
  for (const BundlePoint& point : bundle.points) {
    poses.clear();
    std::fill(seen.begin(), seen.end(), 0);
    for (int i = point.first; i < point.first + point.count; ++i) {
      const int row = layout.pose_row[bundle.observations[i].pose];
      if (row < 0) continue;
      poses.push_back(row / 6);
      set(row / 6, seen.data());
    }
    for (const int pose : poses) {
      uint64_t* words = &found[static_cast<size_t>(pose) * num_words];
      for (int word = 0; word < num_words; ++word) words[word] |= seen[word];
    }
  }
  PosePattern pattern(size);
  for (int row = 0; row < size; ++row) {
    uint64_t* words = &found[static_cast<size_t>(row) * num_words];
    set(row, words);
    for (int column = row; column < size; ++column) {
      if (words[column / kBits] >> column % kBits & 1) pattern[row].push_back(column);
    }
  }
  return pattern;
}

bool IsFasterSparse(const PosePattern& pattern) {
  constexpr double kSlowness = 5;  // of SimplicialLLT beside Eigen's LLT: measured 4 to 6
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

std::unique_ptr<ExplicitSystem> MakeSystem(const PosePattern& chosen, const BundleLayout& layout,
                                           int num_threads) {
  return chosen.empty() ? MakeDenseSystem(layout, num_threads) : MakeSparseSystem(chosen, layout);
}

}  // namespace skein
