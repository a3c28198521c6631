#include "testing/ceres_bundle.h"

#include <ceres/ceres.h>
#include <ceres/normal_prior.h>
#include <ceres/rotation.h>

#include <algorithm>
#include <stdexcept>

#include "sfm/camera.h"
#include "sfm/pose.h"

namespace skein {
namespace {

constexpr int kOpenCv = 4;  // COLMAP's id

// COLMAP's camera models. Project: the pixel of the point (u, v, 1) in the camera's frame.
struct SimplePinholeModel {
  static constexpr int kNumParams = 3;
  template <typename T>
  static void Project(const T* params, const T& u, const T& v, T* pixel) {
    pixel[0] = params[0] * u + params[1];
    pixel[1] = params[0] * v + params[2];
  }
};

struct PinholeModel {
  static constexpr int kNumParams = 4;
  template <typename T>
  static void Project(const T* params, const T& u, const T& v, T* pixel) {
    pixel[0] = params[0] * u + params[2];
    pixel[1] = params[1] * v + params[3];
  }
};

struct SimpleRadialModel {
  static constexpr int kNumParams = 4;
  template <typename T>
  static void Project(const T* params, const T& u, const T& v, T* pixel) {
    const T scale = T(1) + params[3] * (u * u + v * v);
    SimplePinholeModel::Project(params, T(scale * u), T(scale * v), pixel);
  }
};

struct RadialModel {
  static constexpr int kNumParams = 5;
  template <typename T>
  static void Project(const T* params, const T& u, const T& v, T* pixel) {
    const T r2 = u * u + v * v;
    const T scale = T(1) + params[3] * r2 + params[4] * r2 * r2;
    SimplePinholeModel::Project(params, T(scale * u), T(scale * v), pixel);
  }
};

struct OpenCvModel {
  static constexpr int kNumParams = 8;
  template <typename T>
  static void Project(const T* params, const T& u, const T& v, T* pixel) {
    const T u2 = u * u, v2 = v * v, uv = u * v, r2 = u2 + v2;
    const T scale = T(1) + params[4] * r2 + params[5] * r2 * r2;
    const T &p1 = params[6], &p2 = params[7];
    const T x = scale * u + T(2) * p1 * uv + p2 * (r2 + T(2) * u2);
    const T y = scale * v + T(2) * p2 * uv + p1 * (r2 + T(2) * v2);
    PinholeModel::Project(params, x, y, pixel);
  }
};

template <typename Model>
struct ReprojectionResidual {
  template <typename T>
  bool operator()(const T* q, const T* t, const T* point, const T* params, T* residuals) const {
    T in_camera[3];
    ceres::UnitQuaternionRotatePoint(q, point, in_camera);
    const T z = in_camera[2] + t[2];
    const T u = (in_camera[0] + t[0]) / z, v = (in_camera[1] + t[1]) / z;
    Model::Project(params, u, v, residuals);
    residuals[0] -= T(pixel.x());
    residuals[1] -= T(pixel.y());
    return true;
  }

  Eigen::Vector2d pixel;
};

template <typename Model>
ceres::CostFunction* MakeCostOf(const Eigen::Vector2d& pixel) {
  using Residual = ReprojectionResidual<Model>;
  return new ceres::AutoDiffCostFunction<Residual, 2, 4, 3, 3, Model::kNumParams>(
      new Residual{pixel});
}

// The problem owns it.
ceres::CostFunction* MakeCost(int model_id, const Eigen::Vector2d& pixel) {
  switch (model_id) {
    case kSimplePinhole:
      return MakeCostOf<SimplePinholeModel>(pixel);
    case kPinhole:
      return MakeCostOf<PinholeModel>(pixel);
    case kSimpleRadial:
      return MakeCostOf<SimpleRadialModel>(pixel);
    case kRadial:
      return MakeCostOf<RadialModel>(pixel);
    case kOpenCv:
      return MakeCostOf<OpenCvModel>(pixel);
    default:
      throw std::invalid_argument("no residual for Ceres of the camera model " +
                                  CameraModelName(model_id));
  }
}

// COLMAP 3.8: BundleAdjuster::Solve.
void ChooseLinearSolver(size_t num_poses, ceres::Solver::Options* options) {
  constexpr size_t kMaxDense = 50, kMaxSparse = 1000;
  options->linear_solver_type = num_poses <= kMaxDense    ? ceres::DENSE_SCHUR
                                : num_poses <= kMaxSparse ? ceres::SPARSE_SCHUR
                                                          : ceres::ITERATIVE_SCHUR;
  options->preconditioner_type = ceres::SCHUR_JACOBI;  // of the last
}

ceres::Solver::Options SolverOptions(const CeresOptions& options, size_t num_poses) {
  constexpr int kMaxInvalidSteps = 10;  // COLMAP's
  ceres::Solver::Options result;
  ChooseLinearSolver(num_poses, &result);
  result.max_num_iterations = options.max_iterations;
  result.max_linear_solver_iterations = options.max_linear_iterations;
  result.max_num_consecutive_invalid_steps = kMaxInvalidSteps;
  result.function_tolerance = options.function_tolerance;
  result.gradient_tolerance = options.gradient_tolerance;
  result.parameter_tolerance = options.parameter_tolerance;
  result.num_threads = options.num_threads;
  result.logging_type = ceres::SILENT;
  return result;
}

// Parameter blocks are the bundle's own values, and a quaternion of each pose.
class CeresProblem {
 public:
  CeresProblem(double loss_scale_px, Bundle* bundle)
      : bundle_(*bundle), loss_(loss_scale_px), problem_(WithoutItsLoss()) {
    for (const BundlePose& pose : bundle_.poses) {
      qvecs_.push_back(RotationMatrixToQuaternion(pose.R));
    }
    for (BundlePoint& point : bundle_.points) AddPoint(&point);
    for (size_t i = 0; i < bundle_.poses.size(); ++i) SetPose(i);
    for (BundleCamera& camera : bundle_.cameras) SetCamera(&camera);
    HoldGauge();
  }

  CeresSummary Solve(const CeresOptions& options) {
    ceres::Solver::Summary summary;
    ceres::Solve(SolverOptions(options, qvecs_.size()), &problem_, &summary);
    for (size_t i = 0; i < qvecs_.size(); ++i) {
      if (IsFree(i)) bundle_.poses[i].R = QuaternionToRotationMatrix(qvecs_[i]);
    }
    return {summary.IsSolutionUsable(), summary.num_linear_solves, summary.final_cost};
  }

 private:
  static ceres::Problem::Options WithoutItsLoss() {
    ceres::Problem::Options options;
    options.loss_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
    return options;
  }

  void AddPoint(BundlePoint* point) {
    for (int i = point->first; i < point->first + point->count; ++i) {
      const BundleObservation& observation = bundle_.observations[i];
      BundlePose& pose = bundle_.poses[observation.pose];
      BundleCamera& camera = bundle_.cameras[pose.camera];
      problem_.AddResidualBlock(MakeCost(camera.model_id, observation.pixel), &loss_,
                                qvecs_[observation.pose].data(), pose.t.data(), point->xyz.data(),
                                camera.params.data());
    }
    if (point->constant && point->count > 0) problem_.SetParameterBlockConstant(point->xyz.data());
  }

  // A pose or a camera without observations is no part of the problem.
  void SetPose(size_t i) {
    if (!problem_.HasParameterBlock(qvecs_[i].data())) return;
    problem_.SetManifold(qvecs_[i].data(), new ceres::QuaternionManifold);
    if (bundle_.poses[i].constant) Hold(i);
  }

  void SetCamera(BundleCamera* camera) {
    double* params = camera->params.data();
    if (!problem_.HasParameterBlock(params)) return;
    if (camera->refined.empty()) return problem_.SetParameterBlockConstant(params);
    const int num_params = static_cast<int>(camera->params.size());
    std::vector<int> held;
    for (int i = 0; i < num_params; ++i) {
      const auto& refined = camera->refined;
      if (std::find(refined.begin(), refined.end(), i) == refined.end()) held.push_back(i);
    }
    if (!held.empty()) problem_.SetManifold(params, new ceres::SubsetManifold(num_params, held));
    AddPrior(camera);
  }

  void AddPrior(BundleCamera* camera) {
    if (camera->prior_sigma.empty()) return;
    const Eigen::Index num_params = camera->params.size();
    ceres::Matrix root_information = ceres::Matrix::Zero(num_params, num_params);
    for (const int i : camera->refined) {
      if (camera->prior_sigma[i] > 0) root_information(i, i) = 1 / camera->prior_sigma[i];
    }
    const Eigen::Map<const Eigen::VectorXd> prior(camera->prior.data(), num_params);
    problem_.AddResidualBlock(new ceres::NormalPrior(root_information, prior), nullptr,
                              camera->params.data());
  }

  // COLMAP 3.8: IncrementalMapper::AdjustGlobalBundle.
  void HoldGauge() {
    const auto is_held = [](const BundlePose& pose) { return pose.constant; };
    const std::vector<BundlePose>& poses = bundle_.poses;
    if (std::any_of(poses.begin(), poses.end(), is_held) || !IsFree(0) || !IsFree(1)) return;
    Hold(0);
    problem_.SetManifold(bundle_.poses[1].t.data(), new ceres::SubsetManifold(3, {0}));
  }

  void Hold(size_t i) {
    problem_.SetParameterBlockConstant(qvecs_[i].data());
    problem_.SetParameterBlockConstant(bundle_.poses[i].t.data());
  }

  bool IsFree(size_t i) const {
    if (i >= qvecs_.size() || !problem_.HasParameterBlock(qvecs_[i].data())) return false;
    return !problem_.IsParameterBlockConstant(qvecs_[i].data());
  }

  Bundle& bundle_;
  ceres::SoftLOneLoss loss_;
  ceres::Problem problem_;
  std::vector<Eigen::Vector4d> qvecs_;  // (w, x, y, z)
};

}  // namespace

CeresSummary SolveByCeres(const CeresOptions& options, Bundle* bundle) {
  return CeresProblem(options.loss_scale_px, bundle).Solve(options);
}

}  // namespace skein
