#pragma once

#include <Eigen/Core>
#include <vector>

#include "sfm/camera.h"
#include "sfm/feature_match.h"
#include "sfm/ransac.h"

namespace skein {

// Relation of two images: model, pose, inliers. Values of `config` are those of COLMAP's database.
struct TwoViewGeometry {
  enum ConfigurationType {
    UNDEFINED = 0,
    DEGENERATE = 1,           // too few inliers
    CALIBRATED = 2,           // E explains the pair
    UNCALIBRATED = 3,         // F
    PLANAR = 4,               // H, with a baseline
    PANORAMIC = 5,            // H, a rotation
    PLANAR_OR_PANORAMIC = 6,  // H
    WATERMARK = 7,            // a shift of the border alone
    MULTIPLE = 8,             // several of these; the other values are unset
  };

  int config = UNDEFINED;
  Eigen::Matrix3d E = Eigen::Matrix3d::Zero();     // x2' E x1 = 0, x on the plane at depth 1
  Eigen::Matrix3d F = Eigen::Matrix3d::Zero();     // x2' F x1 = 0, x in pixels
  Eigen::Matrix3d H = Eigen::Matrix3d::Zero();     // x2 ~ H x1, x in pixels
  Eigen::Vector4d qvec = Eigen::Vector4d::Zero();  // camera 2 from camera 1, (w, x, y, z)
  Eigen::Vector3d tvec = Eigen::Vector3d::Zero();
  FeatureMatches inlier_matches;
  double tri_angle = 0;  // median triangulation angle in radians
};

// CALIBRATED or UNCALIBRATED. A plane's or a rotation's matches have many epipolar geometries.
bool IsByEssential(int config);

// Points are pixels of the two images, one a keypoint; matches index them.
struct ImagePair {
  const Camera& camera1;
  const std::vector<Eigen::Vector2d>& points1;
  const Camera& camera2;
  const std::vector<Eigen::Vector2d>& points2;
};

// An error in pixels of two images on the plane at depth 1: the mean of the two cameras.
double NormalizedError(const Camera& camera1, const Camera& camera2, double error_px);

// Pose, angle and, where it is open, the choice between PLANAR and PANORAMIC: from E, or from H
// where that explains the pair, with the inlier matches. False if `config` names neither.
bool EstimateRelativePose(const ImagePair& pair, TwoViewGeometry* geometry);

// The pose of camera 2 from camera 1 that puts most points before both cameras. Points on the plane
// at depth 1.
void PoseFromEssentialMatrix(const Eigen::Matrix3d& E, const std::vector<Eigen::Vector2d>& points1,
                             const std::vector<Eigen::Vector2d>& points2, Eigen::Matrix3d* R,
                             Eigen::Vector3d* t, std::vector<Eigen::Vector3d>* points3D);

// COLMAP's estimation for cameras with known focal lengths: E, F and H by a LO-RANSAC each. Without
// a pose. Uses the thread's random numbers.
TwoViewGeometry EstimateCalibrated(const ImagePair& pair, const FeatureMatches& matches,
                                   const RansacLimits& limits);

// COLMAP's whole decision on a pair: by E if both focal lengths are known, else by F; with a pose.
// Uses the thread's random numbers.
TwoViewGeometry EstimateByColmap(const ImagePair& pair, const FeatureMatches& matches,
                                 const RansacLimits& limits);

// Whether most inliers lie at the border and are shifted alike. `points1[i]` and `points2[i]`
// match.
bool IsWatermark(const ImagePair& pair, size_t num_inliers, const std::vector<char>& inlier_mask,
                 const RansacLimits& limits);

}  // namespace skein
