#pragma once

// What came of matching one photo with others.

#include "formats/formats.h"
#include "matching/pair_matcher.h"

namespace skein {

struct PhotoMatches {
  int num_tried = 0;
  TwoViewPairs pairs;    // the verified ones, most inliers first, of as many the lower id
  double match_s = 0;    // time in descriptor matching, summed over pairs
  double verify_s = 0;   // time in verification, summed over pairs
  double elapsed_s = 0;  // from start to end, all threads at once

  // `result` is from the photo to the other: x_other^T F x_photo = 0, other_from_photo.
  void Add(int64_t other_id, const PairResult& result);
};

}  // namespace skein
