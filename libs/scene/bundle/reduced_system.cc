#include "bundle/reduced_system.h"

#include <Eigen/Cholesky>
#include <Eigen/SparseCholesky>
#include <algorithm>
#include <cstdint>

#include "bundle/dense_factor.h"

namespace skein {
namespace {

class DenseSystem : public ExplicitSystem {
 public:
  DenseSystem(const BundleLayout& layout, int num_threads)
      : ExplicitSystem({}, layout), num_threads_(num_threads) {}

  bool Solve(const Eigen::VectorXd& damping, const Eigen::VectorXd& b,
             Eigen::VectorXd* x) override {
    U_.resize(b.size(), b.size());
    ForEachPoseBlock([this](int row, int column, const Matrix6d& block) {
      U_.block<6, 6>(row, column) = block;
    });
    U_.rightCols(b.size() - num_pose_rows()) = SchurBorder();
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

class SparseSystem : public ExplicitSystem {
 public:
  using ExplicitSystem::ExplicitSystem;

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
    const Eigen::VectorXd A_b = llt_.solve(b.head(num_pose_rows()));
    x.head(num_pose_rows()) = A_b;
    const auto border = B_.cols();
    if (border == 0) return x;
    x.tail(border) = border_llt_.solve(b.tail(border) - B_.transpose() * A_b);
    x.head(num_pose_rows()) -= A_B_ * x.tail(border);
    return x;
  }

 private:
  Eigen::SparseMatrix<double> Matrix(const Eigen::VectorXd& damping) const {
    std::vector<Eigen::Triplet<double>> entries;
    entries.reserve(36 * num_pose_blocks());
    ForEachPoseBlock([&](int row, int column, const Matrix6d& block) {
      for (int c = 0; c < 6; ++c) {
        for (int r = 0; r < 6 && row + r <= column + c; ++r) {
          const bool is_diagonal = row + r == column + c;
          entries.emplace_back(row + r, column + c,
                               block(r, c) + (is_diagonal ? damping[row + r] : 0.0));
        }
      }
    });
    Eigen::SparseMatrix<double> S(num_pose_rows(), num_pose_rows());
    S.setFromTriplets(entries.begin(), entries.end());
    return S;
  }

  bool DecomposeBorder(const Eigen::VectorXd& damping) {
    const Eigen::MatrixXd border = SchurBorder();
    const auto size = border.cols();
    B_ = border.topRows(num_pose_rows());
    if (size == 0) return true;
    Eigen::MatrixXd C = border.bottomRows(size);
    C.diagonal() += damping.tail(size);
    C = C.selfadjointView<Eigen::Upper>();
    A_B_ = llt_.solve(B_);
    border_llt_.compute(C - B_.transpose() * A_B_);
    return border_llt_.info() == Eigen::Success;
  }

  Eigen::SimplicialLLT<Eigen::SparseMatrix<double>, Eigen::Upper> llt_;
  bool analysed_ = false;
  Eigen::MatrixXd B_, A_B_;  // A_B_: A^-1 B
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

ReducedSystem::ReducedSystem(const BundleLayout& layout)
    : gradient(layout.size),
      schur_gradient(layout.size),
      num_pose_rows_(6 * layout.num_free_poses),
      poses_(6, num_pose_rows_),
      cameras_(kMaxIntrinsics, layout.size - num_pose_rows_),
      cross_(layout.num_free_poses),
      camera_of_pose_(layout.num_free_poses) {
  const auto rows_of = [&](size_t camera) -> Rows {
    if (layout.camera_row[camera] < 0) return {};
    return {layout.camera_row[camera], layout.camera_size[camera]};
  };
  for (size_t i = 0; i < layout.camera_row.size(); ++i) {
    if (rows_of(i).size > 0) camera_rows_.push_back(rows_of(i));
  }
  for (size_t i = 0; i < layout.pose_row.size(); ++i) {
    if (layout.pose_row[i] >= 0)
      camera_of_pose_[layout.pose_row[i] / 6] = rows_of(layout.camera_of_pose[i]);
  }
}

Eigen::VectorXd ReducedSystem::Diagonal() const {
  Eigen::VectorXd diagonal(gradient.size());
  for (int row = 0; row < num_pose_rows_; row += 6) {
    diagonal.segment<6>(row) = pose_block(row).diagonal();
  }
  for (const Rows& rows : camera_rows_) {
    diagonal.segment(rows.first, rows.size) =
        cameras_.block(0, rows.first - num_pose_rows_, rows.size, rows.size).diagonal();
  }
  return diagonal;
}

void ReducedSystem::SetZero() {
  gradient.setZero();
  schur_gradient.setZero();
  poses_.setZero();
  cameras_.setZero();
  for (auto& block : cross_) block.setZero();
}

void ReducedSystem::Add(const ReducedSystem& other) {
  gradient += other.gradient;
  schur_gradient += other.schur_gradient;
  poses_ += other.poses_;
  cameras_ += other.cameras_;
  for (size_t i = 0; i < cross_.size(); ++i) cross_[i] += other.cross_[i];
}

void ReducedSystem::AddProduct(const Eigen::VectorXd& x, Eigen::VectorXd* y) const {
  for (int row = 0; row < num_pose_rows_; row += 6) {
    y->segment<6>(row).noalias() += pose_block(row) * x.segment<6>(row);
    const Rows& camera = camera_of_pose_[row / 6];
    if (camera.size == 0) continue;
    const auto W = cross_[row / 6].leftCols(camera.size);
    y->segment<6>(row) += W * x.segment(camera.first, camera.size);
    y->segment(camera.first, camera.size) += W.transpose() * x.segment<6>(row);
  }
  for (const Rows& rows : camera_rows_) {
    y->segment(rows.first, rows.size) +=
        cameras_.block(0, rows.first - num_pose_rows_, rows.size, rows.size) *
        x.segment(rows.first, rows.size);
  }
}

Eigen::MatrixXd ReducedSystem::Border() const {
  Eigen::MatrixXd border = Eigen::MatrixXd::Zero(gradient.size(), cameras_.cols());
  for (const Rows& rows : camera_rows_) {
    const int column = rows.first - num_pose_rows_;
    border.block(rows.first, column, rows.size, rows.size) =
        cameras_.block(0, column, rows.size, rows.size);
  }
  for (size_t i = 0; i < camera_of_pose_.size(); ++i) {
    const Rows& rows = camera_of_pose_[i];
    if (rows.size == 0) continue;
    border.block(6 * i, rows.first - num_pose_rows_, 6, rows.size) = cross_[i].leftCols(rows.size);
  }
  return border;
}

SchurBlocks::SchurBlocks(const PosePattern& pattern, const BundleLayout& layout)
    : num_poses_(layout.num_free_poses),
      num_pose_rows_(6 * num_poses_),
      columns_(pattern),
      first_(num_poses_ + 1, 0),
      border_(layout.size, layout.size - num_pose_rows_) {
  for (int i = 0; i < num_poses_; ++i) first_[i + 1] = first_[i] + NumColumns(i);
  blocks_.resize(first_.back());
}

size_t SchurBlocks::IndexOf(int i, int j) const {
  if (columns_.empty()) return first_[i] + (j - i);
  return first_[i] +
         (std::lower_bound(columns_[i].begin(), columns_[i].end(), j) - columns_[i].begin());
}

void SchurBlocks::SetZero() {
  for (Matrix6d& block : blocks_) block.setZero();
  border_.setZero();
}

void SchurBlocks::Add(const SchurBlocks& other) {
  for (size_t i = 0; i < blocks_.size(); ++i) blocks_[i] += other.blocks_[i];
  border_ += other.border_;
}

void ExplicitSystem::SetZero() {
  ReducedSystem::SetZero();
  schur_.SetZero();
}

void ExplicitSystem::Add(const ExplicitSystem& other) {
  ReducedSystem::Add(other);
  schur_.Add(other.schur_);
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
