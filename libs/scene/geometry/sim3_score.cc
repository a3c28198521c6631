#include "geometry/sim3_score.h"

#include <ceres/ceres.h>
#include <ceres/rotation.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "sfm/projection.h"

namespace skein {
namespace {

constexpr double kReferenceSizePx = 1600.0;
constexpr size_t kMaxRefinedPoints = 600;  // of one photo: more adds time, not accuracy

double ErrorPx(const CameraPose& pose, const Camera& camera, const Eigen::Vector3d& xyz,
               const Eigen::Vector2d& pixel) {
  const Eigen::Vector3d in_camera = pose.Apply(xyz);
  if (!(in_camera.z() > std::numeric_limits<double>::epsilon())) {
    return std::numeric_limits<double>::infinity();
  }
  return (camera.WorldToImage(in_camera.hnormalized()) - pixel).norm();
}

// One point seen in one direction. The similarity or its inverse moves the point; camera and point
// stay constant. Parameters: log scale, rotation (wxyz), translation.
struct TransferError {
  CameraPose pose;
  int model_id;
  std::vector<double> params;
  Eigen::Vector3d xyz;
  Eigen::Vector2d pixel;
  bool forward;  // xyz in the source, camera in the target

  template <typename T>
  void Transfer(const T* log_scale, const T* q, const T* t, T* out) const {
    using std::exp;
    const T scale = exp(log_scale[0]);
    T point[3] = {T(xyz.x()), T(xyz.y()), T(xyz.z())};
    if (forward) {
      ceres::UnitQuaternionRotatePoint(q, point, out);
      for (int i = 0; i < 3; ++i) out[i] = scale * out[i] + t[i];
      return;
    }
    for (int i = 0; i < 3; ++i) point[i] = (point[i] - t[i]) / scale;
    const T inverse[4] = {q[0], -q[1], -q[2], -q[3]};
    ceres::UnitQuaternionRotatePoint(inverse, point, out);
  }

  template <typename T>
  bool operator()(const T* log_scale, const T* q, const T* t, T* residuals) const {
    T world[3];
    Transfer(log_scale, q, t, world);
    const T camera_q[4] = {T(pose.rotation.w()), T(pose.rotation.x()), T(pose.rotation.y()),
                           T(pose.rotation.z())};
    T in_camera[3];
    ceres::UnitQuaternionRotatePoint(camera_q, world, in_camera);
    for (int i = 0; i < 3; ++i) in_camera[i] += T(pose.translation[i]);
    if (in_camera[2] <= T(1e-12)) return false;
    if (!ToPixel(in_camera, residuals)) return false;
    residuals[0] -= T(pixel.x());
    residuals[1] -= T(pixel.y());
    return true;
  }

  bool ToPixel(const double* in_camera, double* out) const {
    Eigen::Vector2d projected;
    if (!Project(model_id, params, Eigen::Map<const Eigen::Vector3d>(in_camera), &projected)) {
      return false;
    }
    std::copy(projected.data(), projected.data() + 2, out);
    return true;
  }

  // The chain rule with the camera's derivatives.
  template <int N>
  bool ToPixel(const ceres::Jet<double, N>* in_camera, ceres::Jet<double, N>* out) const {
    const Eigen::Vector3d point(in_camera[0].a, in_camera[1].a, in_camera[2].a);
    Eigen::Vector2d projected;
    Eigen::Matrix<double, 2, 3> J;
    if (!ProjectWithJacobians(model_id, params, point, &projected, &J, nullptr)) return false;
    for (int k = 0; k < 2; ++k) {
      out[k].a = projected[k];
      out[k].v = J(k, 0) * in_camera[0].v + J(k, 1) * in_camera[1].v + J(k, 2) * in_camera[2].v;
    }
    return true;
  }
};

using TransferCost = ceres::AutoDiffCostFunction<TransferError, 2, 1, 4, 3>;

void AddPoint(const SharedPhoto& image, const SharedPhoto::CommonPoint& point,
              ceres::LossFunction* loss, double* log_scale, double* q, double* t,
              ceres::Problem* problem) {
  auto* forward = new TransferError{image.cam_from_target,
                                    image.target_camera.ModelId(),
                                    image.target_camera.Params(),
                                    point.source_xyz,
                                    point.pixel,
                                    true};
  auto* backward = new TransferError{image.cam_from_source,
                                     image.source_camera.ModelId(),
                                     image.source_camera.Params(),
                                     point.target_xyz,
                                     point.pixel,
                                     false};
  problem->AddResidualBlock(new TransferCost(forward), loss, log_scale, q, t);
  problem->AddResidualBlock(new TransferCost(backward), loss, log_scale, q, t);
}

size_t AddImage(const SharedPhoto& image, const Similarity& initial, double max_error_px,
                ceres::LossFunction* loss, double* log_scale, double* q, double* t,
                ceres::Problem* problem) {
  const Similarity inverse = initial.Inverse();
  const size_t step = std::max<size_t>(1, image.points.size() / kMaxRefinedPoints);
  size_t num_added = 0;
  for (size_t i = 0; i < image.points.size(); i += step) {
    double mean_px = 0;
    if (SymmetricErrorPx(image, image.points[i], initial, inverse, &mean_px) > max_error_px) {
      continue;
    }
    AddPoint(image, image.points[i], loss, log_scale, q, t, problem);
    ++num_added;
  }
  return num_added;
}

}  // namespace

double MaxErrorPx(const Camera& target_camera) {
  const double size = std::max(target_camera.Width(), target_camera.Height());
  return kMaxSim3ErrorPx * (size > 0 ? size / kReferenceSizePx : 1.0);
}

double SymmetricErrorPx(const SharedPhoto& image, const SharedPhoto::CommonPoint& point,
                        const Similarity& target_from_source, const Similarity& source_from_target,
                        double* mean_px) {
  const double forward = ErrorPx(image.cam_from_target, image.target_camera,
                                 target_from_source.Apply(point.source_xyz), point.pixel);
  const double backward = ErrorPx(image.cam_from_source, image.source_camera,
                                  source_from_target.Apply(point.target_xyz), point.pixel);
  *mean_px = 0.5 * (forward + backward);
  return std::max(forward, backward);
}

ImageScore ScoreImage(const SharedPhoto& image, const Similarity& target_from_source,
                      int max_points) {
  const Similarity source_from_target = target_from_source.Inverse();
  const double max_error_px = MaxErrorPx(image.target_camera);
  const size_t step =
      max_points > 0 ? std::max<size_t>(1, (image.points.size() + max_points - 1) / max_points) : 1;
  ImageScore score;
  for (size_t i = 0; i < image.points.size(); i += step) {
    double mean_px = 0;
    ++score.num_points;
    if (!(SymmetricErrorPx(image, image.points[i], target_from_source, source_from_target,
                           &mean_px) <= max_error_px)) {
      continue;
    }
    ++score.num_inliers;
    score.sum_error_px += mean_px;
  }
  return score;
}

Similarity RefineSim3(const std::vector<SharedPhoto>& shared, const std::vector<bool>& used,
                      const Similarity& initial) {
  double log_scale = std::log(initial.scale);
  double q[4] = {initial.rotation.w(), initial.rotation.x(), initial.rotation.y(),
                 initial.rotation.z()};
  Eigen::Vector3d t = initial.translation;
  ceres::Problem::Options problem_options;
  problem_options.loss_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  ceres::SoftLOneLoss loss(1.0);
  ceres::Problem problem(problem_options);
  size_t num_points = 0;
  for (size_t i = 0; i < shared.size(); ++i) {
    if (!used[i]) continue;
    num_points += AddImage(shared[i], initial, MaxErrorPx(shared[i].target_camera), &loss,
                           &log_scale, q, t.data(), &problem);
  }
  if (num_points < 4) return initial;
  problem.SetManifold(q, new ceres::QuaternionManifold);
  ceres::Solver::Options solver_options;
  solver_options.linear_solver_type = ceres::DENSE_QR;
  solver_options.max_num_iterations = 50;
  solver_options.num_threads = 1;
  solver_options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(solver_options, &problem, &summary);
  if (!summary.IsSolutionUsable()) return initial;
  return {std::exp(log_scale), Eigen::Quaterniond(q[0], q[1], q[2], q[3]).normalized(), t};
}

}  // namespace skein
