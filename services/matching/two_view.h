#pragma once

// Geometric verification of putative matches: COLMAP's decision between E, F and H, from one
// search.
//
// COLMAP searches E, F and H by a LO-RANSAC each, until a model with an inlier ratio of 0.25 would
// have been found. Here E is searched where both cameras have focal priors, else F:
//  - Samples come from the surest matches first (PROSAC; Chum and Matas 2005), so few trials do:
//    after t of them from the best (t / 200,000)^(1 / k) of the matches, with k matches a sample.
//    1,000 trials of five matches reach the best third. A model is found with confidence 0.999 if
//    0.37 of this third are its inliers. A pair without geometry costs no more than that.
//  - The pair needs 15 inliers, so with 30 matches the ratio is 0.5. The search ends, with the same
//    confidence, once such a model would have been found.
//  - With priors F is fitted to E's inliers and grows from there, so it is F where the priors are
//    wrong.
//  - H matters if it explains 0.8 of the inliers of E and F. H is searched among these inliers.
//    Without E and F it is searched among all matches.

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "core/limits.h"
#include "sfm/camera.h"
#include "sfm/feature_match.h"
#include "sfm/two_view_geometry.h"

namespace skein {

// That a search finds the model, if there is one: COLMAP's.
constexpr double kTwoViewConfidence = 0.999;

// Inliers of a verified pair, and the smallest share of them that a search finds: COLMAP's.
constexpr int kMinPairInliers = 15;
constexpr double kMinPairInlierRatio = 0.25;

// SIMPLE_RADIAL without distortion, principal point in the middle. Throws std::invalid_argument
// unless the sizes and the focal length are positive and finite.
Camera PriorCamera(int width_px, int height_px, double focal_px, bool focal_is_prior);

// Points are full-resolution pixels, one a keypoint. `matches`: the surest first. Matches index the
// points and must be in range (throws std::invalid_argument). E is used
// when both cameras have a focal prior. Deterministic by `seed`. The result has
//
//   config          DEGENERATE or WATERMARK when the pair is not verified
//   inlier_matches  of the model that explains the pair
//   qvec, tvec      camera 2 from camera 1, |tvec| = 1 or 0 (panoramic)
//   tri_angle       median triangulation angle, radians
//
// Without focal priors E, pose and angle follow from F and the assumed focal lengths. A pair that a
// rotation explains, with whatever focal lengths, is panoramic (geometry/free_focal.h).
TwoViewGeometry EstimateTwoView(const Camera& camera1, const std::vector<Eigen::Vector2d>& points1,
                                const Camera& camera2, const std::vector<Eigen::Vector2d>& points2,
                                const FeatureMatches& matches, uint32_t seed);

// Whether such a search finds a model with enough inliers: no pose, no test for a rotation or a
// watermark.
bool HaveGeometry(const Camera& camera1, const std::vector<Eigen::Vector2d>& points1,
                  const Camera& camera2, const std::vector<Eigen::Vector2d>& points2,
                  const FeatureMatches& matches, uint32_t seed);

// F between pixels of the model that explains the pair: from E where E does.
Eigen::Matrix3d EpipolarModel(const Camera& camera1, const Camera& camera2,
                              const TwoViewGeometry& geometry);

// Whether the pair shows one scene from a geometry that can be used.
bool IsVerified(const TwoViewGeometry& geometry);

// |z| of the unit relative translation; 0 without translation.
double ForwardMotion(const TwoViewGeometry& geometry);

}  // namespace skein
