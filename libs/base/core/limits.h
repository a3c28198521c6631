// Limits of geometry that several stages share. The limits stand in the lowest room because stages
// from matching to merging need them.
#pragma once

#include <array>

namespace skein::limits {

// Largest reprojection error of an observation that stays in the map, that a track takes in, and of
// those of two points that merge: COLMAP's filter_max_reproj_error, complete_max_reproj_error and
// merge_max_reproj_error. Also the largest Sampson error of a verified match: COLMAP's two-view
// max_error.
constexpr double kMaxErrorPx = 4.0;

// Largest error of an inlier of an absolute pose, which the map's points are not adjusted to yet:
// COLMAP's abs_pose_max_error.
constexpr double kMaxPoseErrorPx = 12.0;

// Inliers that an absolute pose needs: COLMAP's abs_pose_min_num_inliers.
constexpr int kMinPoseInliers = 30;

// Inliers of the pair that a map begins with: COLMAP's init_min_num_inliers.
constexpr int kMinSeedInliers = 100;

// Smallest triangulation angle of a new point and of one that stays in the map: COLMAP's min_angle
// and filter_min_tri_angle.
constexpr double kMinTriangulationAngleDeg = 1.5;

// Median triangulation angle asked of an initial pair, and its relaxations. The first is COLMAP's
// init_min_tri_angle.
constexpr std::array<double, 4> kInitialAnglesDeg = {16, 8, 4, 2};

// Possible intrinsics, as COLMAP's mapper has them: focal length over the larger side of the image,
// magnitude of a distortion parameter.
constexpr double kMinFocalRatio = 0.1;
constexpr double kMaxFocalRatio = 10.0;
constexpr double kMaxDistortion = 1.0;

// Priors of intrinsics, as standard deviations: of a focal length, over it, if EXIF tells it and if
// it is guessed; of a distortion parameter.
constexpr double kFocalSigmaExif = 0.1;
constexpr double kFocalSigmaGuess = 0.3;
constexpr double kDistortionSigma = 0.1;

}  // namespace skein::limits
