#pragma once

// Guided matching: mutual nearest neighbours with ratio test as in kernel.h, but a feature's
// neighbours are only those that agree with a known geometry of the two photos (Hartley and
// Zisserman 2004, section 11.6; COLMAP's guided matching). epipolar_fan.h finds these, about a
// hundredth of all.
//
// The ratio test compares with neighbours along the line alone. So structures that repeat across
// the line no longer spoil each other's match, and those that repeat along it still do. Few
// neighbours refuse less, so the ratio is stricter: with 0.7 the share of false matches is about
// that of the full product with 0.8.

#include <Eigen/Core>
#include <vector>

#include "matching/epipolar_fan.h"
#include "matching/kernel.h"
#include "matching/photo_features.h"

namespace skein {

struct GuidedOptions {
  double max_error_px = 4;  // Sampson error
  int max_distance_sq = MatchOptions().max_distance_sq;
  double max_ratio = 0.7;
  KernelVersion kernel = FastestKernel();
};

class GuidedMatcher {
 public:
  explicit GuidedMatcher(const GuidedOptions& options) : options_(options) {}

  // Neighbours by x2^T F x1 = 0, in pixels. Matches are ordered by `first`. An F that is zero or
  // not finite gives none. Both photos need their index.
  std::vector<IndexPair> Match(const PhotoFeatures& first, const PhotoFeatures& second,
                               const Eigen::Matrix3d& F);

 private:
  struct Nearest {
    int32_t best_sq, second_sq;
    uint32_t best;  // of equally near ones the lowest index

    void Insert(int32_t distance_sq, uint32_t index);
  };

  // Copies descriptors of the second photo in the order of the fan, where those that are compared
  // with one feature lie together.
  void Arrange(const PhotoFeatures& second);
  bool Passes(const Nearest& nearest) const;

  GuidedOptions options_;
  EpipolarFan fan_;
  std::vector<uint8_t> descriptors_;  // of the second photo, by place in the fan
  std::vector<int32_t> norm_sq_;      // likewise
  std::vector<uint32_t> place_of_;    // each feature of the second photo
  std::vector<uint32_t> neighbours_;  // places
  std::vector<int32_t> dots_;
  std::vector<Nearest> rows_, columns_;  // columns_ by place
};

}  // namespace skein
