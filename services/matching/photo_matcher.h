#pragma once

// A photo against its candidates: putative matches, then geometric verification of each pair.

#include <vector>

#include "formats/formats.h"
#include "matching/pair_matcher.h"
#include "matching/photo_features.h"

namespace skein {

struct PhotoMatches {
  int num_tried = 0;
  TwoViewPairs pairs;    // the verified ones, most inliers first
  double match_s = 0;    // time in descriptor matching, summed over pairs
  double verify_s = 0;   // time in verification, summed over pairs
  double elapsed_s = 0;  // from start to end, all threads at once
};

// Takes in more pairs of the same photo.
void Append(PhotoMatches more, PhotoMatches* matches);

struct PhotoMatcherOptions {
  PairMatcherOptions pair;
  int num_threads = 1;

  Status Check() const;
};

class PhotoMatcher {
 public:
  // Throws std::invalid_argument on bad options.
  explicit PhotoMatcher(const PhotoMatcherOptions& options);

  // The result does not depend on the number of threads. Pairs hold geometry from `photo` to the
  // other: x_other^T F x_photo = 0, other_from_photo.
  PhotoMatches Match(const PhotoFeatures& photo, const std::vector<PhotoFeaturesPtr>& others);

 private:
  PhotoMatcherOptions options_;
  std::vector<PairMatcher> matchers_;  // one a thread
};

}  // namespace skein
