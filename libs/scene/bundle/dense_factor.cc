#include "bundle/dense_factor.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <vector>

#include "bundle/factor_kernels.h"
#include "core/threads.h"

namespace skein {
namespace {

using Index = Eigen::Index;

constexpr Index kPanelRows = 192;
constexpr Index kStripColumns = 96;  // that a thread takes at once; of whole tiles
constexpr Index kBlockRows = 384;    // of a solution, and what a thread takes at once
static_assert(kStripColumns % kMaxTileRows == 0 && kStripColumns % kTileColumns == 0);

class Decomposition {
 public:
  Decomposition(int num_threads, InstructionSet version, Eigen::MatrixXd* S)
      : num_threads_(num_threads), kernel_(FactorKernelOf(version)), S_(*S) {}

  bool Run() {
    for (Index first = 0; first < S_.rows(); first += kPanelRows) {
      depth_ = std::min(kPanelRows, S_.rows() - first);
      next_ = first + depth_;
      Eigen::Ref<Eigen::MatrixXd> diagonal = S_.block(first, first, depth_, depth_);
      const Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>, Eigen::Upper> llt(diagonal);
      if (llt.info() != Eigen::Success) return false;
      const Index num_strips = (S_.cols() - next_ + kStripColumns - 1) / kStripColumns;
      left_.resize(num_strips * kStripColumns * depth_);
      right_.resize(left_.size());
      ForEachOnThreads(num_threads_, num_strips, [&](size_t i) { SolveStrip(first, i); });
      ForEachOnThreads(num_threads_, num_strips, [&](size_t i) { SubtractStrip(i); });
    }
    return true;
  }

 private:
  Index ColumnsOf(Index strip) const {
    return std::min(kStripColumns, S_.cols() - next_ - strip * kStripColumns);
  }

  // The panel's rows in columns of the strip, which are packed for the kernel, too.
  void SolveStrip(Index first, Index strip) {
    const Index column = next_ + strip * kStripColumns, num_columns = ColumnsOf(strip);
    const auto diagonal = S_.block(first, first, depth_, depth_).triangularView<Eigen::Upper>();
    auto panel = S_.block(first, column, depth_, num_columns);
    diagonal.adjoint().solveInPlace(panel);
    Pack(panel, kernel_.rows, &left_[strip * kStripColumns * depth_]);
    Pack(panel, kTileColumns, &right_[strip * kStripColumns * depth_]);
  }

  // By tiles of `width` columns, row by row; zeros fill up the last one.
  void Pack(const Eigen::Ref<const Eigen::MatrixXd>& panel, Index width, double* packed) const {
    for (Index tile = 0; tile < panel.cols(); tile += width) {
      for (Index c = 0; c < width; ++c) {
        for (Index k = 0; k < depth_; ++k)
          packed[k * width + c] = tile + c < panel.cols() ? panel(k, tile + c) : 0.0;
      }
      packed += width * depth_;
    }
  }

  // From all rows of the strip's columns down to the diagonal.
  void SubtractStrip(Index strip) {
    const Index begin = strip * kStripColumns, end = begin + ColumnsOf(strip);
    for (Index row = 0; row < end; row += kernel_.rows) {
      for (Index column = begin; column < end; column += kTileColumns) {
        if (row < column + kTileColumns) SubtractTile(row, column);
      }
    }
  }

  void SubtractTile(Index row, Index column) {
    TileTask task{static_cast<int>(depth_), &left_[row * depth_], &right_[column * depth_],
                  &S_(next_ + row, next_ + column), S_.outerStride()};
    const Index rows = std::min<Index>(kernel_.rows, S_.rows() - next_ - row);
    const Index columns = std::min<Index>(kTileColumns, S_.cols() - next_ - column);
    if (rows == kernel_.rows && columns == kTileColumns) {
      kernel_.subtract(task);
      return;
    }
    Eigen::Matrix<double, kMaxTileRows, kTileColumns> tile;
    tile.setZero();
    task.C = tile.data();
    task.stride = kMaxTileRows;
    kernel_.subtract(task);
    S_.block(next_ + row, next_ + column, rows, columns) += tile.topLeftCorner(rows, columns);
  }

  const int num_threads_;
  const FactorKernel kernel_;
  Eigen::MatrixXd& S_;
  Index depth_ = 0;                   // rows of the panel
  Index next_ = 0;                    // row after it
  std::vector<double> left_, right_;  // the panel, packed as A and B of tiles
};

}  // namespace

bool DecomposeDense(int num_threads, Eigen::MatrixXd* S, InstructionSet version) {
  return Decomposition(num_threads, version, S).Run();
}

Eigen::VectorXd SolveDense(int num_threads, const Eigen::MatrixXd& U, Eigen::VectorXd x) {
  const Index size = U.rows(), num_blocks = (size + kBlockRows - 1) / kBlockRows;
  const auto for_each_strip = [&](Index begin, Index end, const auto& function) {
    const Index num_strips = (end - begin + kBlockRows - 1) / kBlockRows;
    ForEachOnThreads(std::min<Index>(num_threads, num_strips), num_strips, [&](size_t i) {
      const Index first = begin + static_cast<Index>(i) * kBlockRows;
      function(first, std::min(kBlockRows, end - first));
    });
  };
  for (Index block = 0; block < num_blocks; ++block) {
    const Index first = block * kBlockRows, rows = std::min(kBlockRows, size - first);
    const auto diagonal = U.block(first, first, rows, rows).triangularView<Eigen::Upper>();
    x.segment(first, rows) = diagonal.adjoint().solve(x.segment(first, rows));
    for_each_strip(first + rows, size, [&](Index column, Index columns) {
      x.segment(column, columns).noalias() -=
          U.block(first, column, rows, columns).transpose() * x.segment(first, rows);
    });
  }
  for (Index block = num_blocks - 1; block >= 0; --block) {
    const Index first = block * kBlockRows, columns = std::min(kBlockRows, size - first);
    const auto diagonal = U.block(first, first, columns, columns).triangularView<Eigen::Upper>();
    x.segment(first, columns) = diagonal.solve(x.segment(first, columns));
    for_each_strip(0, first, [&](Index row, Index rows) {
      x.segment(row, rows).noalias() -=
          U.block(row, first, rows, columns) * x.segment(first, columns);
    });
  }
  return x;
}

}  // namespace skein
