#pragma once

// Overlays stand at one place of the photos although the scene moves: burnt-in text, a date stamp,
// dirt on the lens, a car's bonnet, the background of a turntable. Their matches agree with each
// other better than those of the scene, so they would be taken for the geometry of a pair.
//
// A match stands still if both keypoints lie within the largest error of one pixel. Still matches
// alone prove nothing: photos of a burst or from a tripod stand still as a whole, and so does a far
// background before a camera that moves without turning.
//
// A pair. Its still matches, S of the photo's N keypoints, are
//
//  contradicted  if the other matches verify the pair, and the still matches fit an overlay better
//                than the pair's geometry F. A match of the scene agrees with F with probability
//                1 - kNoise, a match of an overlay with p, the share of the photo's keypoints x
//                with x^T F x within the error: the likelihood of all still matches decides. If
//                p >= 1 - kNoise, as for a camera that does not turn, they are not contradicted.
//  few           if most of the photo does not stand still. If still matches were spread as the
//                keypoints are, field f of an 8 x 8 grid, with n_f keypoints, would hold one with
//                probability 1 - (1 - S/N)^n_f. Few: less than half of the expected fields do.
//
// Few that are contradicted are an overlay. Few without another geometry verify nothing: the photos
// do not stand still, so they have no overlap that a map could use. Many that are contradicted
// are a background that stands still, as of a turntable, or a tripod's scene in which an object
// moves: the photo's other pairs decide.
//
// A plane or a rotation has many geometries F, of which the estimated one contradicts still matches
// by chance. If a homography explains the other matches, the pair has a background only if no F
// explains still and other matches together. The likelihood ratio decides, less BIC's price of
// seven parameters. Errors are normal, and kNoise of them exceed limits::kMaxErrorPx.
//
// A photo. Its keypoints in overlays are left out of all its pairs where they stand still, with
// keypoints nearby: so also where the pair alone does not tell. Many that are contradicted count as
// an overlay from one pair on whose object a map could begin with (limits::kMinSeedInliers), or
// from kPairsOfABackground pairs on, unless they move with the scene in another pair. A pair whose
// still matches lie there for the most part is then that of its moving matches.
//
// The ledger. All pairs of a photo stand still if the object has turned out of sight. Such pairs
// are of the background if two of the other photos see the object from apart (photo_matches.h).
// Pairs that were concluded before the ledger could tell stay in it.

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <vector>

#include "matching/photo_features.h"
#include "matching/two_view.h"
#include "sfm/two_view_geometry.h"

namespace skein {

// Overlay evidence of a pair, from the first photo to the second.
struct OverlayEvidence {
  std::vector<uint32_t> overlay;     // keypoints of the first photo
  std::vector<uint32_t> background;  // the same of many that are contradicted
  // Geometry of the moving matches, if it is verified and not yet the pair's: with `background`.
  std::optional<TwoViewGeometry> of_moving;
};

struct PairEstimate {
  TwoViewGeometry geometry;  // of all matches, or of those that move
  OverlayEvidence evidence;
};

// EstimateTwoView with overlays left out. A second search is made only if at least
// kMinPairInliers matches stand still. Photos of different size have no place in common.
PairEstimate EstimateWithoutOverlay(const PhotoFeatures& first, const PhotoFeatures& second,
                                    const FeatureMatches& matches, uint32_t seed);

// For each match, whether it stands still, to limits::kMaxErrorPx.
std::vector<char> StandStill(const PhotoFeatures& first, const PhotoFeatures& second,
                             const FeatureMatches& matches);

// A pair of the photo, as verified by itself.
struct PairWithEvidence {
  TwoViewGeometry geometry;
  std::vector<char> stand_still;  // of geometry.inlier_matches
  OverlayEvidence evidence;
};

// Decides over all pairs of a photo, with its keypoints, as above. A pair that has less than
// kMinPairInliers inliers left is DEGENERATE.
void LeaveOutOverlay(const std::vector<Eigen::Vector2d>& points,
                     std::vector<PairWithEvidence>* pairs);

// Whether the pair has no geometry but that nothing moved: it is panoramic, and at least a share of
// 1 - kNoise of its inliers stands still.
bool IsStill(const PairWithEvidence& pair);

// Leaves the pair the geometry of its moving matches, if that is verified; else it is DEGENERATE.
void KeepMoving(PairWithEvidence* pair);

}  // namespace skein
