#include "merger/seam_bundle.h"

#include <ceres/ceres.h>

#include <map>
#include <unordered_set>

#include "base/camera_models.h"
#include "base/cost_functions.h"

namespace skein {
namespace {

using colmap::camera_t;
using colmap::image_t;
using colmap::point3D_t;

class Bundle {
 public:
  Bundle(const std::set<image_t>& free_images, const SeamOptions& options,
         colmap::Reconstruction* model)
      : free_images_(free_images), options_(options), model_(*model), problem_(ProblemOptions()) {}

  SeamSummary Solve() {
    SeamSummary result;
    AddResiduals();
    result.num_residuals = problem_.NumResiduals();
    result.num_free_images = static_cast<int>(free_images_.size());
    if (result.num_residuals == 0) return result;
    SetManifolds();
    ceres::Solver::Summary summary;
    ceres::Solve(SolverOptions(), &problem_, &summary);
    for (const image_t id : free_images_) model_.Image(id).NormalizeQvec();
    result.usable = summary.IsSolutionUsable();
    result.initial_cost = summary.initial_cost;
    result.final_cost = summary.final_cost;
    return result;
  }

 private:
  static ceres::Problem::Options ProblemOptions() {
    ceres::Problem::Options options;
    options.loss_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
    return options;
  }

  ceres::Solver::Options SolverOptions() const {
    ceres::Solver::Options options;
    options.max_num_iterations = options_.max_iterations;
    options.num_threads = options_.num_threads;
    options.linear_solver_type =
        free_images_.size() <= 50 ? ceres::DENSE_SCHUR : ceres::SPARSE_SCHUR;
    options.function_tolerance = 1e-5;
    options.logging_type = ceres::SILENT;
    return options;
  }

  void AddResiduals() {
    std::unordered_set<point3D_t> point_ids;
    for (const image_t id : free_images_) {
      for (const colmap::Point2D& point2D : model_.Image(id).Points2D()) {
        if (point2D.HasPoint3D()) point_ids.insert(point2D.Point3DId());
      }
    }
    for (const point3D_t id : std::set<point3D_t>(point_ids.begin(), point_ids.end())) AddPoint(id);
  }

  void AddPoint(point3D_t id) {
    colmap::Point3D& point = model_.Point3D(id);
    for (const colmap::TrackElement& element : point.Track().Elements()) {
      colmap::Image& image = model_.Image(element.image_id);
      if (!image.IsRegistered()) continue;
      const Eigen::Vector2d& pixel = image.Point2D(element.point2D_idx).XY();
      if (free_images_.count(element.image_id)) {
        AddFree(pixel, &image, &point);
      } else {
        AddHeld(pixel, image, &point);
        has_held_ = true;
      }
      ++num_observations_[image.CameraId()];
    }
  }

  void AddFree(const Eigen::Vector2d& pixel, colmap::Image* image, colmap::Point3D* point) {
    colmap::Camera& camera = model_.Camera(image->CameraId());
    switch (camera.ModelId()) {
#define CAMERA_MODEL_CASE(CameraModel)                                                         \
  case colmap::CameraModel::kModelId:                                                          \
    problem_.AddResidualBlock(                                                                 \
        colmap::BundleAdjustmentCostFunction<colmap::CameraModel>::Create(pixel), &loss_,      \
        image->Qvec().data(), image->Tvec().data(), point->XYZ().data(), camera.ParamsData()); \
    break;
      CAMERA_MODEL_SWITCH_CASES
#undef CAMERA_MODEL_CASE
    }
  }

  void AddHeld(const Eigen::Vector2d& pixel, const colmap::Image& image, colmap::Point3D* point) {
    colmap::Camera& camera = model_.Camera(image.CameraId());
    switch (camera.ModelId()) {
#define CAMERA_MODEL_CASE(CameraModel)                                                 \
  case colmap::CameraModel::kModelId:                                                  \
    problem_.AddResidualBlock(                                                         \
        colmap::BundleAdjustmentConstantPoseCostFunction<colmap::CameraModel>::Create( \
            image.Qvec(), image.Tvec(), pixel),                                        \
        &loss_, point->XYZ().data(), camera.ParamsData());                             \
    break;
      CAMERA_MODEL_SWITCH_CASES
#undef CAMERA_MODEL_CASE
    }
  }

  void SetManifolds() {
    for (const image_t id : free_images_) {
      double* qvec = model_.Image(id).Qvec().data();
      if (problem_.HasParameterBlock(qvec)) colmap::SetQuaternionManifold(&problem_, qvec);
    }
    if (!has_held_) FixGauge();
    for (const auto& [camera_id, unused] : num_observations_) SetIntrinsics(camera_id);
  }

  // Seven degrees of freedom: a whole pose, and one coordinate of the translation farthest from it.
  void FixGauge() {
    const image_t first = *free_images_.begin();
    image_t second = first;
    double farthest = 0;
    for (const image_t id : free_images_) {
      const double distance =
          (model_.Image(id).ProjectionCenter() - model_.Image(first).ProjectionCenter()).norm();
      if (distance <= farthest) continue;
      farthest = distance;
      second = id;
    }
    colmap::Image& image = model_.Image(first);
    if (!problem_.HasParameterBlock(image.Qvec().data())) return;
    problem_.SetParameterBlockConstant(image.Qvec().data());
    problem_.SetParameterBlockConstant(image.Tvec().data());
    double* tvec = model_.Image(second).Tvec().data();
    if (second == first || !problem_.HasParameterBlock(tvec)) return;
    Eigen::Index largest = 0;
    model_.Image(second).Tvec().cwiseAbs().maxCoeff(&largest);
    colmap::SetSubsetManifold(3, {static_cast<int>(largest)}, &problem_, tvec);
  }

  bool MayRefineIntrinsics(camera_t camera_id) const {
    int num_free = 0;
    for (const image_t id : model_.RegImageIds()) {
      if (model_.Image(id).CameraId() != camera_id) continue;
      if (!free_images_.count(id)) return false;
      ++num_free;
    }
    return num_free >= options_.min_images_for_intrinsics;
  }

  // Focal length and distortion are refined, the principal point stays, as in COLMAP.
  void SetIntrinsics(camera_t camera_id) {
    colmap::Camera& camera = model_.Camera(camera_id);
    if (!MayRefineIntrinsics(camera_id)) {
      problem_.SetParameterBlockConstant(camera.ParamsData());
      return;
    }
    std::vector<int> held(camera.PrincipalPointIdxs().begin(), camera.PrincipalPointIdxs().end());
    colmap::SetSubsetManifold(static_cast<int>(camera.NumParams()), held, &problem_,
                              camera.ParamsData());
  }

  const std::set<image_t>& free_images_;
  const SeamOptions& options_;
  colmap::Reconstruction& model_;
  ceres::SoftLOneLoss loss_{options_.loss_scale_px};
  ceres::Problem problem_;
  std::map<camera_t, int> num_observations_;
  bool has_held_ = false;
};

}  // namespace

SeamSummary AdjustSeam(const std::set<image_t>& free_images, const SeamOptions& options,
                       colmap::Reconstruction* model) {
  return Bundle(free_images, options, model).Solve();
}

}  // namespace skein
