#pragma once

// Result of matching one photo with others.

#include <utility>
#include <vector>

#include "formats/formats.h"
#include "matching/pair_matcher.h"

namespace skein {

class PhotoMatches {
 public:
  int num_tried = 0;
  TwoViewPairs pairs;    // the verified ones, most inliers first, of as many the lower id:
                         // of Conclude
  double match_s = 0;    // time in descriptor matching, summed over pairs
  double verify_s = 0;   // time in verification, summed over pairs
  double elapsed_s = 0;  // from start to end, all threads at once

  // `result` is from the photo to the other: x_other^T F x_photo = 0, other_from_photo.
  void Add(int64_t other_id, const PairResult& result);
  // After all: makes the pairs, without overlays. `points`: the photo's keypoints.
  void Conclude(const std::vector<Eigen::Vector2d>& points);

 private:
  std::vector<int64_t> other_ids_;       // of added_, in any order
  std::vector<PairWithEvidence> added_;  // that are verified or could be
};

}  // namespace skein
