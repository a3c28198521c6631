#include "sfm/camera_fit.h"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <utility>
#include <vector>

#include "sfm/projection.h"

namespace skein {
namespace {

constexpr int kGridSide = 16;
constexpr int kMaxIterations = 50;
constexpr double kMaxRayErrorPx = 0.1;
constexpr double kConverged = 1e-12;  // relative decrease of the sum of squares

struct Sight {
  Eigen::Vector2d pixel;
  Eigen::Vector3d ray;  // z = 1
};

std::vector<Sight> SightsOf(const Camera& camera) {
  std::vector<Sight> sights;
  const Eigen::Vector2d size(camera.Width(), camera.Height());
  for (int y = 0; y < kGridSide; ++y) {
    for (int x = 0; x < kGridSide; ++x) {
      const Eigen::Vector2d pixel =
          (Eigen::Vector2d(x, y).array() + 0.5).matrix().cwiseProduct(size) / kGridSide;
      const Eigen::Vector2d on_plane = camera.ImageToWorld(pixel);
      if (!on_plane.allFinite()) continue;
      if (!((camera.WorldToImage(on_plane) - pixel).norm() <= kMaxRayErrorPx)) continue;
      sights.push_back({pixel, on_plane.homogeneous()});
    }
  }
  return sights;
}

// Focal lengths and distortion. Two equal focal lengths stay equal: the second follows.
std::vector<size_t> FreeParams(const Camera& camera) {
  const int model_id = camera.ModelId();
  std::vector<size_t> free = CameraModelFocalLengthIdxs(model_id);
  if (camera.HasTwoEqualFocalLengths()) free.pop_back();
  const std::vector<size_t>& extra = CameraModelExtraParamsIdxs(model_id);
  free.insert(free.end(), extra.begin(), extra.end());
  return free;
}

// The normal equations of the sum of squared distances in the photo.
struct Normals {
  Eigen::MatrixXd H;
  Eigen::VectorXd b;
  double sum = 0;
};

Normals NormalsOf(const std::vector<Sight>& sights, const std::vector<size_t>& free,
                  const Camera& camera) {
  const Eigen::Index n = static_cast<Eigen::Index>(free.size());
  Normals normals{Eigen::MatrixXd::Zero(n, n), Eigen::VectorXd::Zero(n), 0};
  for (const Sight& sight : sights) {
    Eigen::Vector2d pixel;
    Eigen::Matrix<double, 2, 3> J_ray;
    IntrinsicsJacobian J_all;
    ProjectWithJacobians(camera.ModelId(), camera.Params(), sight.ray, &pixel, &J_ray, &J_all);
    if (camera.HasTwoEqualFocalLengths()) J_all.col(0) += J_all.col(1);
    Eigen::MatrixXd J(2, n);
    for (Eigen::Index i = 0; i < n; ++i) J.col(i) = J_all.col(static_cast<Eigen::Index>(free[i]));
    normals.H += J.transpose() * J;
    normals.b += J.transpose() * (sight.pixel - pixel);
    normals.sum += (sight.pixel - pixel).squaredNorm();
  }
  return normals;
}

}  // namespace

Camera FitCameraModel(const Camera& camera, int model_id) {
  if (camera.ModelId() == model_id) return camera;
  Camera fitted = camera;
  fitted.InitializeWithId(model_id, camera.MeanFocalLength(), camera.Width(), camera.Height());
  fitted.SetFocalLengthX(camera.FocalLengthX());
  if (fitted.FocalLengthIdxs().size() > 1) fitted.SetFocalLengthY(camera.FocalLengthY());
  fitted.SetPrincipalPointX(camera.PrincipalPointX());
  fitted.SetPrincipalPointY(camera.PrincipalPointY());
  const std::vector<size_t> free = FreeParams(fitted);
  const bool is_square = fitted.HasTwoEqualFocalLengths();
  const std::vector<Sight> sights = SightsOf(camera);
  Normals now = NormalsOf(sights, free, fitted);
  double damping = 1e-3;
  for (int i = 0; i < kMaxIterations; ++i) {
    Eigen::MatrixXd H = now.H;
    H.diagonal() *= 1 + damping;
    const Eigen::VectorXd step = H.ldlt().solve(now.b);
    if (!step.allFinite()) break;
    Camera moved = fitted;
    std::vector<double> params = fitted.Params();
    for (size_t k = 0; k < free.size(); ++k) params[free[k]] += step(k);
    moved.SetParams(params);
    if (is_square) moved.SetFocalLengthY(moved.FocalLengthX());
    Normals next = NormalsOf(sights, free, moved);
    const bool is_smaller = next.sum < now.sum;
    damping *= is_smaller ? 0.1 : 10;
    if (!is_smaller) continue;
    const bool is_converged = now.sum - next.sum <= kConverged * now.sum;
    fitted = std::move(moved);
    now = std::move(next);
    if (is_converged) break;
  }
  return fitted;
}

}  // namespace skein
