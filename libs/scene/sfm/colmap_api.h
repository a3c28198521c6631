#pragma once

// COLMAP, for the .cc files of libs/scene/sfm alone: 3.8 (Debian 12) has other headers, names and
// types than 3.10 (Debian 13). CMake finds the version and defines SKEIN_COLMAP_VERSION: 308, 310.

#if SKEIN_COLMAP_VERSION < 309
#define SKEIN_ESSENTIAL_MATRIX_POLY "estimators/essential_matrix_poly.h"
#define SKEIN_ESSENTIAL_MATRIX_COEFFS "estimators/essential_matrix_coeffs.h"
#include "base/camera.h"
#include "base/camera_database.h"
#include "base/camera_models.h"
#include "base/database.h"
#include "base/essential_matrix.h"
#include "base/homography_matrix.h"
#include "base/polynomial.h"
#include "estimators/essential_matrix.h"
#include "estimators/fundamental_matrix.h"
#include "estimators/homography_matrix.h"
#include "estimators/pose.h"
#include "estimators/two_view_geometry.h"
#include "estimators/utils.h"
#include "feature/types.h"
#include "optim/combination_sampler.h"
#include "optim/loransac.h"
#include "util/random.h"
#else
#define SKEIN_ESSENTIAL_MATRIX_POLY "colmap/estimators/essential_matrix_poly.h"
#define SKEIN_ESSENTIAL_MATRIX_COEFFS "colmap/estimators/essential_matrix_coeffs.h"
#include "colmap/estimators/essential_matrix.h"
#include "colmap/estimators/fundamental_matrix.h"
#include "colmap/estimators/homography_matrix.h"
#include "colmap/estimators/pose.h"
#include "colmap/estimators/two_view_geometry.h"
#include "colmap/estimators/utils.h"
#include "colmap/feature/types.h"
#include "colmap/geometry/essential_matrix.h"
#include "colmap/geometry/homography_matrix.h"
#include "colmap/math/polynomial.h"
#include "colmap/math/random.h"
#include "colmap/optim/combination_sampler.h"
#include "colmap/optim/loransac.h"
#include "colmap/scene/camera.h"
#include "colmap/scene/database.h"
#include "colmap/sensor/database.h"
#include "colmap/sensor/models.h"
#endif

#include <vector>

#include "sfm/camera.h"
#include "sfm/ransac.h"
#include "sfm/two_view_geometry.h"

namespace skein::colmap_api {

template <class Container>
std::vector<size_t> Copy(const Container& container) {
  return std::vector<size_t>(container.begin(), container.end());
}

// The pose of a second camera from the first, or from the world.
struct Pose {
  Eigen::Vector4d qvec{1, 0, 0, 0};
  Eigen::Vector3d tvec{0, 0, 0};
};

#if SKEIN_COLMAP_VERSION < 309

using TwoViewOptions = colmap::TwoViewGeometry::Options;

inline int ModelId(int id) { return id; }

template <class Model>
constexpr int IdOf() {
  return Model::kModelId;
}

template <class Model>
constexpr int NumParamsOf() {
  return Model::kNumParams;
}

template <class Model, class T>
void ImageFromPlane(const T* params, const T& u, const T& v, T* x, T* y) {
  Model::WorldToImage(params, u, v, x, y);
}

inline Eigen::Vector2d ImageFromPlane(int model_id, const std::vector<double>& params,
                                      const Eigen::Vector2d& uv) {
  Eigen::Vector2d xy;
  colmap::CameraModelWorldToImage(model_id, params, uv[0], uv[1], &xy[0], &xy[1]);
  return xy;
}

inline Eigen::Vector2d PlaneFromImage(int model_id, const std::vector<double>& params,
                                      const Eigen::Vector2d& xy) {
  Eigen::Vector2d uv;
  colmap::CameraModelImageToWorld(model_id, params, xy[0], xy[1], &uv[0], &uv[1]);
  return uv;
}

inline colmap::Camera ToColmap(const Camera& camera) {
  colmap::Camera copy;
  copy.SetCameraId(camera.CameraId());
  copy.SetModelId(camera.ModelId());
  copy.SetWidth(camera.Width());
  copy.SetHeight(camera.Height());
  copy.SetParams(camera.Params());
  copy.SetPriorFocalLength(camera.HasPriorFocalLength());
  return copy;
}

inline Camera FromColmap(const colmap::Camera& camera) {
  Camera copy;
  copy.SetCameraId(camera.CameraId());
  copy.SetModelId(camera.ModelId());
  copy.SetWidth(camera.Width());
  copy.SetHeight(camera.Height());
  copy.SetParams(camera.Params());
  copy.SetPriorFocalLength(camera.HasPriorFocalLength());
  return copy;
}

inline Pose PoseOf(const colmap::TwoViewGeometry& geometry) {
  return {geometry.qvec, geometry.tvec};
}

inline void SetPose(const Pose& pose, colmap::TwoViewGeometry* geometry) {
  geometry->qvec = pose.qvec;
  geometry->tvec = pose.tvec;
}

template <class Estimator>
std::vector<typename Estimator::M_t> Models(const std::vector<typename Estimator::X_t>& x,
                                            const std::vector<typename Estimator::Y_t>& y) {
  return Estimator::Estimate(x, y);
}

inline uint32_t RandomUpTo(uint32_t largest) { return colmap::RandomInteger<uint32_t>(0, largest); }

// An estimator of ours (Estimate returns its models) as COLMAP's RANSAC takes it.
template <class Ours>
using ForRansac = Ours;

// A sampler that COLMAP's RANSAC takes: Derived has void Draw(std::vector<size_t>*).
template <class Derived>
class SamplerOf : public colmap::Sampler {
 public:
  std::vector<size_t> Sample() override {
    std::vector<size_t> sample;
    static_cast<Derived*>(this)->Draw(&sample);
    return sample;
  }
};

inline bool EstimatePose(const colmap::AbsolutePoseEstimationOptions& options,
                         const std::vector<Eigen::Vector2d>& pixels,
                         const std::vector<Eigen::Vector3d>& points, const Camera& camera,
                         Pose* cam_from_world, size_t* num_inliers,
                         std::vector<char>* inlier_mask) {
  colmap::Camera copy = ToColmap(camera);
  return colmap::EstimateAbsolutePose(options, pixels, points, &cam_from_world->qvec,
                                      &cam_from_world->tvec, &copy, num_inliers, inlier_mask);
}

inline colmap::TwoViewGeometry EstimateCalibrated(const colmap::Camera& camera1,
                                                  const std::vector<Eigen::Vector2d>& points1,
                                                  const colmap::Camera& camera2,
                                                  const std::vector<Eigen::Vector2d>& points2,
                                                  const colmap::FeatureMatches& matches,
                                                  const TwoViewOptions& options) {
  colmap::TwoViewGeometry geometry;
  geometry.EstimateCalibrated(camera1, points1, camera2, points2, matches, options);
  return geometry;
}

inline colmap::TwoViewGeometry Estimate(const colmap::Camera& camera1,
                                        const std::vector<Eigen::Vector2d>& points1,
                                        const colmap::Camera& camera2,
                                        const std::vector<Eigen::Vector2d>& points2,
                                        const colmap::FeatureMatches& matches,
                                        const TwoViewOptions& options) {
  colmap::TwoViewGeometry geometry;
  geometry.Estimate(camera1, points1, camera2, points2, matches, options);
  return geometry;
}

inline bool DetectWatermark(const colmap::Camera& camera1,
                            const std::vector<Eigen::Vector2d>& points1,
                            const colmap::Camera& camera2,
                            const std::vector<Eigen::Vector2d>& points2, size_t num_inliers,
                            const std::vector<char>& inlier_mask, const TwoViewOptions& options) {
  return colmap::TwoViewGeometry::DetectWatermark(camera1, points1, camera2, points2, num_inliers,
                                                  inlier_mask, options);
}

#else  // 3.10

using TwoViewOptions = colmap::TwoViewGeometryOptions;

inline colmap::CameraModelId ModelId(int id) { return static_cast<colmap::CameraModelId>(id); }

template <class Model>
constexpr int IdOf() {
  return static_cast<int>(Model::model_id);
}

template <class Model>
constexpr int NumParamsOf() {
  return static_cast<int>(Model::num_params);
}

template <class Model, class T>
void ImageFromPlane(const T* params, const T& u, const T& v, T* x, T* y) {
  Model::ImgFromCam(params, u, v, T(1), x, y);
}

inline Eigen::Vector2d ImageFromPlane(int model_id, const std::vector<double>& params,
                                      const Eigen::Vector2d& uv) {
  return colmap::CameraModelImgFromCam(ModelId(model_id), params, uv.homogeneous());
}

inline Eigen::Vector2d PlaneFromImage(int model_id, const std::vector<double>& params,
                                      const Eigen::Vector2d& xy) {
  return colmap::CameraModelCamFromImg(ModelId(model_id), params, xy).hnormalized();
}

inline colmap::Camera ToColmap(const Camera& camera) {
  colmap::Camera copy;
  copy.camera_id = camera.CameraId();
  copy.model_id = ModelId(camera.ModelId());
  copy.width = camera.Width();
  copy.height = camera.Height();
  copy.params = camera.Params();
  copy.has_prior_focal_length = camera.HasPriorFocalLength();
  return copy;
}

inline Camera FromColmap(const colmap::Camera& camera) {
  Camera copy;
  copy.SetCameraId(camera.camera_id);
  copy.SetModelId(static_cast<int>(camera.model_id));
  copy.SetWidth(camera.width);
  copy.SetHeight(camera.height);
  copy.SetParams(camera.params);
  copy.SetPriorFocalLength(camera.has_prior_focal_length);
  return copy;
}

inline Pose FromRigid(const colmap::Rigid3d& pose) {
  const Eigen::Quaterniond& q = pose.rotation;
  return {Eigen::Vector4d(q.w(), q.x(), q.y(), q.z()), pose.translation};
}

inline Pose PoseOf(const colmap::TwoViewGeometry& geometry) {
  return FromRigid(geometry.cam2_from_cam1);
}

inline void SetPose(const Pose& pose, colmap::TwoViewGeometry* geometry) {
  const Eigen::Vector4d& q = pose.qvec;
  geometry->cam2_from_cam1 = colmap::Rigid3d(Eigen::Quaterniond(q[0], q[1], q[2], q[3]), pose.tvec);
}

template <class Estimator>
std::vector<typename Estimator::M_t> Models(const std::vector<typename Estimator::X_t>& x,
                                            const std::vector<typename Estimator::Y_t>& y) {
  std::vector<typename Estimator::M_t> models;
  Estimator::Estimate(x, y, &models);
  return models;
}

inline uint32_t RandomUpTo(uint32_t largest) {
  return colmap::RandomUniformInteger<uint32_t>(0, largest);
}

template <class Ours>
class ForRansac : public Ours {
 public:
  void Estimate(const std::vector<typename Ours::X_t>& x, const std::vector<typename Ours::Y_t>& y,
                std::vector<typename Ours::M_t>* models) const {
    *models = Ours::Estimate(x, y);
  }
};

template <class Derived>
class SamplerOf : public colmap::Sampler {
 public:
  void Sample(std::vector<size_t>* sample) override {
    sample->clear();
    static_cast<Derived*>(this)->Draw(sample);
  }
};

inline bool EstimatePose(const colmap::AbsolutePoseEstimationOptions& options,
                         const std::vector<Eigen::Vector2d>& pixels,
                         const std::vector<Eigen::Vector3d>& points, const Camera& camera,
                         Pose* cam_from_world, size_t* num_inliers,
                         std::vector<char>* inlier_mask) {
  colmap::Camera copy = ToColmap(camera);
  colmap::Rigid3d pose;
  if (!colmap::EstimateAbsolutePose(options, pixels, points, &pose, &copy, num_inliers,
                                    inlier_mask)) {
    return false;
  }
  *cam_from_world = FromRigid(pose);
  return true;
}

inline colmap::TwoViewGeometry EstimateCalibrated(const colmap::Camera& camera1,
                                                  const std::vector<Eigen::Vector2d>& points1,
                                                  const colmap::Camera& camera2,
                                                  const std::vector<Eigen::Vector2d>& points2,
                                                  const colmap::FeatureMatches& matches,
                                                  const TwoViewOptions& options) {
  return colmap::EstimateCalibratedTwoViewGeometry(camera1, points1, camera2, points2, matches,
                                                   options);
}

inline colmap::TwoViewGeometry Estimate(const colmap::Camera& camera1,
                                        const std::vector<Eigen::Vector2d>& points1,
                                        const colmap::Camera& camera2,
                                        const std::vector<Eigen::Vector2d>& points2,
                                        const colmap::FeatureMatches& matches,
                                        const TwoViewOptions& options) {
  return colmap::EstimateTwoViewGeometry(camera1, points1, camera2, points2, matches, options);
}

using colmap::DetectWatermark;

#endif

inline colmap::RANSACOptions ToColmap(const RansacLimits& limits) {
  colmap::RANSACOptions options;
  options.max_error = limits.max_error;
  options.min_inlier_ratio = limits.min_inlier_ratio;
  options.confidence = limits.confidence;
  options.min_num_trials = limits.min_num_trials;
  options.max_num_trials = limits.max_num_trials;
  return options;
}

inline colmap::FeatureMatches ToColmap(const FeatureMatches& matches) {
  colmap::FeatureMatches copy;
  copy.reserve(matches.size());
  for (const FeatureMatch& match : matches) {
    copy.emplace_back(match.point2D_idx1, match.point2D_idx2);
  }
  return copy;
}

inline FeatureMatches FromColmap(const colmap::FeatureMatches& matches) {
  FeatureMatches copy;
  copy.reserve(matches.size());
  for (const auto& match : matches) copy.emplace_back(match.point2D_idx1, match.point2D_idx2);
  return copy;
}

inline colmap::TwoViewGeometry ToColmap(const TwoViewGeometry& geometry) {
  colmap::TwoViewGeometry copy;
  copy.config = geometry.config;
  copy.E = geometry.E;
  copy.F = geometry.F;
  copy.H = geometry.H;
  SetPose({geometry.qvec, geometry.tvec}, &copy);
  copy.tri_angle = geometry.tri_angle;
  copy.inlier_matches = ToColmap(geometry.inlier_matches);
  return copy;
}

inline TwoViewGeometry FromColmap(const colmap::TwoViewGeometry& geometry) {
  TwoViewGeometry copy;
  copy.config = geometry.config;
  copy.E = geometry.E;
  copy.F = geometry.F;
  copy.H = geometry.H;
  const Pose pose = PoseOf(geometry);
  copy.qvec = pose.qvec;
  copy.tvec = pose.tvec;
  copy.tri_angle = geometry.tri_angle;
  copy.inlier_matches = FromColmap(geometry.inlier_matches);
  return copy;
}

}  // namespace skein::colmap_api
