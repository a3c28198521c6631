#pragma once

// Result of matching one photo with others.

#include <vector>

#include "covisibility/covisibility.h"
#include "formats/formats.h"
#include "matching/pair_matcher.h"

namespace skein {

// Two photos that see the same object or scene from apart.
struct PairApart {
  int64_t id1 = 0, id2 = 0;
  int32_t num_inliers = 0;
};

// Pairs among the photos that an epipolar geometry explains, with as many inliers as a map begins
// with.
std::vector<PairApart> PairsApart(const CovisibilityGraph& graph,
                                  const std::vector<int64_t>& image_ids);

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
  // After all: makes the pairs, without overlays. `points`: the photo's keypoints. `apart`: pairs
  // among the other photos. A photo that stands still against both of such a pair, by more inliers,
  // shares a background with them: two views of one scene cannot be that of a third.
  void Conclude(const std::vector<Eigen::Vector2d>& points,
                const std::vector<PairApart>& apart = {});
  // The other photos of the pairs that are verified or could be.
  const std::vector<int64_t>& other_ids() const { return other_ids_; }

 private:
  void LeaveOutBackgroundOf(const std::vector<PairApart>& apart);

  std::vector<int64_t> other_ids_;       // of added_, in any order
  std::vector<PairWithEvidence> added_;  // that are verified or could be
};

}  // namespace skein
