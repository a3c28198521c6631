#pragma once

// Draws any number of global descriptors like real ones.
//
// Places come one after another. Each is one of the real sets with all its photos in order. The
// signs of all values are drawn again for each place, and each photo gets some noise. A change of
// signs keeps every distance within a place, so a photo's neighbours are those of the real photo.
// Photos of two places are on average as dissimilar as photos of two real sets. Their cosines
// scatter by 1 / sqrt(values), less than real ones: two drawn places have nothing in common. So
// drawn places are more isolated than real ones.

#include <Eigen/Core>
#include <cstdint>
#include <set>
#include <vector>

namespace skein::benchmark {

using RowMatrix = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

class DrawnDescriptors {
 public:
  // `sets`: a row of unit length a photo; all of one dimension, none empty.
  DrawnDescriptors(std::vector<RowMatrix> sets, uint64_t seed);

  // Descriptor of photo i >= 0, unit length; a function of sets, seed and i. Fast when i is the
  // photo after the one before.
  Eigen::RowVectorXf Get(int64_t i);
  int64_t PlaceOf(int64_t i);
  Eigen::Index dim() const { return sets_[0].cols(); }

 private:
  void GoTo(int64_t i);

  std::vector<RowMatrix> sets_;
  uint64_t seed_;
  std::vector<int64_t> starts_{0};  // first photo of each place known so far, and of the next
  std::vector<size_t> kinds_;       // index of its set
  size_t place_ = 0;                // whose signs are in signs_
  Eigen::RowVectorXf signs_;
};

struct ExactNeighbour {
  int64_t photo = 0;
  float distance = 0;
};
using ExactNeighbours = std::vector<std::vector<ExactNeighbour>>;  // nearest first

// The k nearest of `drawn`'s photos 0 .. end-1 to each row of `queries`, without those left out.
ExactNeighbours FindExactly(DrawnDescriptors* drawn, const RowMatrix& queries, int64_t end,
                            const std::set<int64_t>& left_out, size_t k);

}  // namespace skein::benchmark
