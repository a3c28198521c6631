#include "sfm/camera.h"

#include <map>
#include <stdexcept>

#include "sfm/colmap_api.h"

namespace skein {
namespace {

struct Model {
  std::string name, params_info;
  std::vector<size_t> focal, principal_point, extra;
  size_t num_params = 0;
};

std::map<int, Model> FindModels() {
  constexpr int kMaxId = 64;
  std::map<int, Model> models;
  for (int id = 0; id <= kMaxId; ++id) {
    const auto colmap_id = colmap_api::ModelId(id);
    if (!colmap::ExistsCameraModelWithId(colmap_id)) continue;
    Model& model = models[id];
    model.name = colmap::CameraModelIdToName(colmap_id);
    model.params_info = colmap::CameraModelParamsInfo(colmap_id);
    model.focal = colmap_api::Copy(colmap::CameraModelFocalLengthIdxs(colmap_id));
    model.principal_point = colmap_api::Copy(colmap::CameraModelPrincipalPointIdxs(colmap_id));
    model.extra = colmap_api::Copy(colmap::CameraModelExtraParamsIdxs(colmap_id));
    model.num_params = colmap::CameraModelNumParams(colmap_id);
  }
  return models;
}

const std::map<int, Model>& Models() {
  static const std::map<int, Model> models = FindModels();
  return models;
}

const Model& ModelOf(int model_id) {
  const auto model = Models().find(model_id);
  if (model != Models().end()) return model->second;
  throw std::invalid_argument("no camera model has the id " + std::to_string(model_id));
}

}  // namespace

static_assert(colmap_api::IdOf<colmap::SimplePinholeCameraModel>() == kSimplePinhole);
static_assert(colmap_api::IdOf<colmap::PinholeCameraModel>() == kPinhole);
static_assert(colmap_api::IdOf<colmap::SimpleRadialCameraModel>() == kSimpleRadial);
static_assert(colmap_api::IdOf<colmap::RadialCameraModel>() == kRadial);
static_assert(colmap_api::IdOf<colmap::OpenCVCameraModel>() == kOpenCv);
static_assert(colmap_api::IdOf<colmap::OpenCVFisheyeCameraModel>() == kOpenCvFisheye);

bool ExistsCameraModel(int model_id) { return Models().count(model_id) > 0; }

bool ExistsCameraModel(const std::string& name) { return colmap::ExistsCameraModelWithName(name); }

int CameraModelId(const std::string& name) {
  for (const auto& [id, model] : Models()) {
    if (model.name == name) return id;
  }
  throw std::invalid_argument("no camera model has the name " + name);
}

const std::string& CameraModelName(int model_id) { return ModelOf(model_id).name; }

const std::string& CameraModelParamsInfo(int model_id) { return ModelOf(model_id).params_info; }

bool AreParamsOfModel(int model_id, const std::vector<double>& params) {
  return ExistsCameraModel(model_id) && ModelOf(model_id).num_params == params.size();
}

std::vector<double> InitialCameraParams(int model_id, double focal_px, size_t width,
                                        size_t height) {
  ModelOf(model_id);
  return colmap::CameraModelInitializeParams(colmap_api::ModelId(model_id), focal_px, width,
                                             height);
}

const std::vector<size_t>& CameraModelFocalLengthIdxs(int model_id) {
  return ModelOf(model_id).focal;
}

const std::vector<size_t>& CameraModelPrincipalPointIdxs(int model_id) {
  return ModelOf(model_id).principal_point;
}

const std::vector<size_t>& CameraModelExtraParamsIdxs(int model_id) {
  return ModelOf(model_id).extra;
}

void Camera::SetModelId(int model_id) {
  params_.resize(ModelOf(model_id).num_params, 0.0);
  model_id_ = model_id;
}

double Camera::MeanFocalLength() const {
  const std::vector<size_t>& indices = FocalLengthIdxs();
  double sum = 0;
  for (const size_t i : indices) sum += params_[i];
  return sum / static_cast<double>(indices.size());
}

void Camera::SetFocalLength(double focal_px) {
  for (const size_t i : FocalLengthIdxs()) params_[i] = focal_px;
}

Eigen::Matrix3d Camera::CalibrationMatrix() const {
  Eigen::Matrix3d K = Eigen::Matrix3d::Identity();
  K(0, 0) = FocalLengthX();
  K(1, 1) = FocalLengthY();
  K(0, 2) = PrincipalPointX();
  K(1, 2) = PrincipalPointY();
  return K;
}

bool Camera::HasBogusParams(double min_focal_ratio, double max_focal_ratio,
                            double max_extra_param) const {
  ModelOf(model_id_);
  return colmap::CameraModelHasBogusParams(colmap_api::ModelId(model_id_), params_, width_, height_,
                                           min_focal_ratio, max_focal_ratio, max_extra_param);
}

void Camera::InitializeWithId(int model_id, double focal_px, size_t width, size_t height) {
  params_ = InitialCameraParams(model_id, focal_px, width, height);
  model_id_ = model_id;
  width_ = width;
  height_ = height;
}

Eigen::Vector2d Camera::ImageToWorld(const Eigen::Vector2d& pixel) const {
  return colmap_api::PlaneFromImage(model_id_, params_, pixel);
}

Eigen::Vector2d Camera::WorldToImage(const Eigen::Vector2d& on_plane) const {
  return colmap_api::ImageFromPlane(model_id_, params_, on_plane);
}

void Camera::Rescale(size_t width, size_t height) {
  const double scale_x = static_cast<double>(width) / static_cast<double>(width_);
  const double scale_y = static_cast<double>(height) / static_cast<double>(height_);
  width_ = width;
  height_ = height;
  SetPrincipalPointX(scale_x * PrincipalPointX());
  SetPrincipalPointY(scale_y * PrincipalPointY());
  if (FocalLengthIdxs().size() == 1) {
    SetFocalLength((scale_x + scale_y) / 2.0 * FocalLengthX());
  } else {
    SetFocalLengthX(scale_x * FocalLengthX());
    SetFocalLengthY(scale_y * FocalLengthY());
  }
}

}  // namespace skein
