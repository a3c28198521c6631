#pragma once

// As many global descriptors as wanted, drawn like real ones.
//
// Places come one after another. Each is one of the real sets, all its photos in their order, with
// the signs of all values drawn anew for the place, and some noise for each photo. A change of
// signs keeps every distance within a place, so the neighbours of a photo lie as the neighbours of
// the real photo do; photos of two places are as unlike as photos of two real sets on average.
// Their cosines scatter by 1 / sqrt(values) only, less than real ones: nothing is common to two
// places, no vegetation, no kind of building that would tell a search where to go. So places are
// islands, more than real ones.

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

  // Of photo i >= 0, unit length; a function of sets, seed and i. Fast when i is the photo after
  // the one before.
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
