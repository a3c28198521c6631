#include "sfm/two_view_geometry.h"

#include <utility>

#include "core/statistics.h"
#include "sfm/colmap_api.h"
#include "sfm/pose.h"
#include "sfm/triangulation.h"

namespace skein {
namespace {

colmap_api::TwoViewOptions ColmapOptions(const RansacLimits& limits) {
  colmap_api::TwoViewOptions options;
  options.ransac_options = colmap_api::ToColmap(limits);
  return options;
}

// One of colmap_api's estimations.
template <class Estimation>
TwoViewGeometry Run(Estimation estimation, const ImagePair& pair, const FeatureMatches& matches,
                    const colmap_api::TwoViewOptions& options) {
  return colmap_api::FromColmap(estimation(colmap_api::ToColmap(pair.camera1), pair.points1,
                                           colmap_api::ToColmap(pair.camera2), pair.points2,
                                           colmap_api::ToColmap(matches), options));
}

struct Inliers {
  std::vector<Eigen::Vector2d> points1, points2;  // on the plane at depth 1
};

Inliers InliersOf(const ImagePair& pair, const FeatureMatches& matches) {
  Inliers inliers;
  for (const FeatureMatch& match : matches) {
    inliers.points1.push_back(pair.camera1.ImageToWorld(pair.points1[match.point2D_idx1]));
    inliers.points2.push_back(pair.camera2.ImageToWorld(pair.points2[match.point2D_idx2]));
  }
  return inliers;
}

double MedianAngle(const Eigen::Vector3d& center2, const std::vector<Eigen::Vector3d>& points) {
  if (points.empty()) return 0;
  std::vector<double> angles;
  for (const Eigen::Vector3d& point : points) {
    angles.push_back(CalculateTriangulationAngle(Eigen::Vector3d::Zero(), center2, point));
  }
  return percentile(std::move(angles), 50);
}

bool IsByHomography(int config) {
  return config == TwoViewGeometry::PLANAR || config == TwoViewGeometry::PANORAMIC ||
         config == TwoViewGeometry::PLANAR_OR_PANORAMIC;
}

void DecideOnBaseline(TwoViewGeometry* geometry) {
  const bool has_baseline = geometry->tvec.norm() != 0;
  geometry->config = has_baseline ? TwoViewGeometry::PLANAR : TwoViewGeometry::PANORAMIC;
  if (!has_baseline) geometry->tri_angle = 0;
}

}  // namespace

double NormalizedError(const Camera& camera1, const Camera& camera2, double error_px) {
  return (camera1.ImageToWorldThreshold(error_px) + camera2.ImageToWorldThreshold(error_px)) / 2;
}

bool IsByEssential(int config) {
  return config == TwoViewGeometry::CALIBRATED || config == TwoViewGeometry::UNCALIBRATED;
}

bool EstimateRelativePose(const ImagePair& pair, TwoViewGeometry* geometry) {
  if (!IsByEssential(geometry->config) && !IsByHomography(geometry->config)) return false;
  const Inliers inliers = InliersOf(pair, geometry->inlier_matches);
  Eigen::Matrix3d R;
  Eigen::Vector3d normal;
  std::vector<Eigen::Vector3d> points3D;
  if (IsByEssential(geometry->config)) {
    PoseFromEssentialMatrix(geometry->E, inliers.points1, inliers.points2, &R, &geometry->tvec,
                            &points3D);
  } else {
    colmap::PoseFromHomographyMatrix(geometry->H, pair.camera1.CalibrationMatrix(),
                                     pair.camera2.CalibrationMatrix(), inliers.points1,
                                     inliers.points2, &R, &geometry->tvec, &normal, &points3D);
  }
  geometry->qvec = RotationMatrixToQuaternion(R);
  geometry->tri_angle = MedianAngle(-R.transpose() * geometry->tvec, points3D);
  if (geometry->config == TwoViewGeometry::PLANAR_OR_PANORAMIC) DecideOnBaseline(geometry);
  return true;
}

void PoseFromEssentialMatrix(const Eigen::Matrix3d& E, const std::vector<Eigen::Vector2d>& points1,
                             const std::vector<Eigen::Vector2d>& points2, Eigen::Matrix3d* R,
                             Eigen::Vector3d* t, std::vector<Eigen::Vector3d>* points3D) {
  colmap::PoseFromEssentialMatrix(E, points1, points2, R, t, points3D);
}

TwoViewGeometry EstimateCalibrated(const ImagePair& pair, const FeatureMatches& matches,
                                   const RansacLimits& limits) {
  return Run(colmap_api::EstimateCalibrated, pair, matches, ColmapOptions(limits));
}

TwoViewGeometry EstimateByColmap(const ImagePair& pair, const FeatureMatches& matches,
                                 const RansacLimits& limits) {
  colmap_api::TwoViewOptions options = ColmapOptions(limits);
  options.compute_relative_pose = true;
  return Run(colmap_api::Estimate, pair, matches, options);
}

bool IsWatermark(const ImagePair& pair, size_t num_inliers, const std::vector<char>& inlier_mask,
                 const RansacLimits& limits) {
  return colmap_api::DetectWatermark(colmap_api::ToColmap(pair.camera1), pair.points1,
                                     colmap_api::ToColmap(pair.camera2), pair.points2, num_inliers,
                                     inlier_mask, ColmapOptions(limits));
}

}  // namespace skein
