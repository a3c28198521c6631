#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "sfm/ids.h"

namespace skein {

// All camera models of the linked COLMAP can be used (SIMPLE_PINHOLE to THIN_PRISM_FISHEYE, with
// RADIAL, OPENCV and FULL_OPENCV): set `camera_model` in [mapper] or [[cameras]] of the config
// file. A model that COLMAP adds later also needs a CAMERA_MODEL_CASE in projection.cc,
// kMaxIntrinsics in projection.h, and, where a format can hold it, KnownModels in
// libs/view/export/nerfstudio.cc and ExpectSimpleCamera in simple_camera.cc. The list of models in
// bundle_test.cc checks its Jacobians.

// Ids of the models that the code names, as in cameras.bin, with their parameters.
constexpr int kInvalidCameraModel = -1;
constexpr int kSimplePinhole = 0;  // f, cx, cy
constexpr int kPinhole = 1;        // fx, fy, cx, cy
constexpr int kSimpleRadial = 2;   // f, cx, cy, k
constexpr int kRadial = 3;         // f, cx, cy, k1, k2
constexpr int kOpenCv = 4;         // fx, fy, cx, cy, k1, k2, p1, p2
constexpr int kOpenCvFisheye = 5;  // fx, fy, cx, cy, k1, k2, k3, k4

// Whether a camera has sides of so many pixels: from 1 to a million.
constexpr bool IsCameraSide(uint64_t side_px) { return side_px >= 1 && side_px <= 1'000'000; }

bool ExistsCameraModel(int model_id);
bool ExistsCameraModel(const std::string& name);
// Throws std::invalid_argument for a name that no model has.
int CameraModelId(const std::string& name);
// Throws std::invalid_argument for an unknown id.
const std::string& CameraModelName(int model_id);
// Names of the model's parameters, in order: "f, cx, cy, k". Throws like CameraModelName.
const std::string& CameraModelParamsInfo(int model_id);
// Whether the model exists and has params.size() parameters.
bool AreParamsOfModel(int model_id, const std::vector<double>& params);
// Distortion 0, principal point in the centre of the photo. Throws std::invalid_argument for an
// unknown model, as the functions below.
std::vector<double> InitialCameraParams(int model_id, double focal_px, size_t width, size_t height);
// Indices into the parameters: focal lengths, principal point, distortion.
const std::vector<size_t>& CameraModelFocalLengthIdxs(int model_id);
const std::vector<size_t>& CameraModelPrincipalPointIdxs(int model_id);
const std::vector<size_t>& CameraModelExtraParamsIdxs(int model_id);

// Intrinsics in pixels. The centre of the upper left pixel is (0.5, 0.5). Functions that need the
// camera model throw std::invalid_argument until it is set.
class Camera {
 public:
  skein::CameraId CameraId() const { return camera_id_; }
  void SetCameraId(skein::CameraId id) { camera_id_ = id; }

  int ModelId() const { return model_id_; }
  const std::string& ModelName() const { return CameraModelName(model_id_); }
  // Resizes the parameters: the first ones keep their values, added ones are 0.
  void SetModelId(int model_id);
  void SetModelIdFromName(const std::string& name) { SetModelId(CameraModelId(name)); }

  size_t Width() const { return width_; }
  size_t Height() const { return height_; }
  void SetWidth(size_t width) { width_ = width; }
  void SetHeight(size_t height) { height_ = height; }

  double MeanFocalLength() const;
  double FocalLengthX() const { return params_[FocalLengthIdxs().front()]; }
  double FocalLengthY() const { return params_[FocalLengthIdxs().back()]; }
  // Whether it has two focal lengths, and they are equal.
  bool HasTwoEqualFocalLengths() const {
    return FocalLengthIdxs().size() == 2 && FocalLengthX() == FocalLengthY();
  }
  void SetFocalLength(double focal_px);
  void SetFocalLengthX(double focal_px) { params_[FocalLengthIdxs().front()] = focal_px; }
  void SetFocalLengthY(double focal_px) { params_[FocalLengthIdxs().back()] = focal_px; }

  // Whether the focal length is known from elsewhere (EXIF, calibration).
  bool HasPriorFocalLength() const { return has_prior_focal_length_; }
  void SetPriorFocalLength(bool has_prior) { has_prior_focal_length_ = has_prior; }

  double PrincipalPointX() const { return params_[PrincipalPointIdxs()[0]]; }
  double PrincipalPointY() const { return params_[PrincipalPointIdxs()[1]]; }
  void SetPrincipalPointX(double x) { params_[PrincipalPointIdxs()[0]] = x; }
  void SetPrincipalPointY(double y) { params_[PrincipalPointIdxs()[1]] = y; }

  // Indices into the parameters.
  const std::vector<size_t>& FocalLengthIdxs() const {
    return CameraModelFocalLengthIdxs(model_id_);
  }
  const std::vector<size_t>& PrincipalPointIdxs() const {
    return CameraModelPrincipalPointIdxs(model_id_);
  }
  const std::vector<size_t>& ExtraParamsIdxs() const {  // distortion
    return CameraModelExtraParamsIdxs(model_id_);
  }

  // 3 x 3, without distortion.
  Eigen::Matrix3d CalibrationMatrix() const;

  const std::vector<double>& Params() const { return params_; }
  std::vector<double>& Params() { return params_; }
  double Params(size_t i) const { return params_[i]; }
  double& Params(size_t i) { return params_[i]; }
  size_t NumParams() const { return params_.size(); }
  void SetParams(const std::vector<double>& params) { params_ = params; }
  bool VerifyParams() const { return AreParamsOfModel(model_id_, params_); }

  // True if one of these fails: min_focal_ratio <= f / max(width, height) <= max_focal_ratio for
  // each focal length f; the principal point lies in the photo; |k| <= max_extra_param for each
  // distortion parameter k. As in COLMAP.
  bool HasBogusParams(double min_focal_ratio, double max_focal_ratio, double max_extra_param) const;

  // As InitialCameraParams.
  void InitializeWithId(int model_id, double focal_px, size_t width, size_t height);
  void InitializeWithName(const std::string& model, double focal_px, size_t width, size_t height) {
    InitializeWithId(CameraModelId(model), focal_px, width, height);
  }

  // Pixel -> (x / z, y / z) in the camera's frame (x right, y down, z forward) and back, with
  // distortion.
  Eigen::Vector2d ImageToWorld(const Eigen::Vector2d& pixel) const;
  Eigen::Vector2d WorldToImage(const Eigen::Vector2d& on_plane) const;
  // distance_px / mean focal length: the threshold on the plane z = 1.
  double ImageToWorldThreshold(double distance_px) const { return distance_px / MeanFocalLength(); }

  // Adapts focal lengths and principal point to the photo resized to `width` x `height`.
  void Rescale(size_t width, size_t height);

 private:
  skein::CameraId camera_id_ = kInvalidCameraId;
  int model_id_ = kInvalidCameraModel;
  size_t width_ = 0;
  size_t height_ = 0;
  std::vector<double> params_;
  bool has_prior_focal_length_ = false;
};

}  // namespace skein
