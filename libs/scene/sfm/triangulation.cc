#include "sfm/triangulation.h"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "core/angles.h"
#include "core/limits.h"
#include "sfm/colmap_api.h"
#include "sfm/reprojection.h"

namespace skein {
namespace {

// Least squares of the distances from the rays, in the homogeneous point.
Eigen::Vector3d TriangulateManyViews(const std::vector<const TriangulationView*>& views) {
  Eigen::Matrix4d A = Eigen::Matrix4d::Zero();
  for (const TriangulationView* view : views) {
    const Eigen::Vector3d ray = view->on_plane.homogeneous().normalized();
    const Matrix3x4d term = view->cam_from_world - ray * ray.transpose() * view->cam_from_world;
    A += term.transpose() * term;
  }
  return Eigen::SelfAdjointEigenSolver<Eigen::Matrix4d>(A).eigenvectors().col(0).hnormalized();
}

bool IsInFrontOfAll(const std::vector<const TriangulationView*>& views,
                    const Eigen::Vector3d& xyz) {
  return std::all_of(views.begin(), views.end(), [&](const TriangulationView* view) {
    return HasPointPositiveDepth(view->cam_from_world, xyz);
  });
}

bool HasAngle(const std::vector<const TriangulationView*>& views, const Eigen::Vector3d& xyz) {
  constexpr double kMinAngleRad = DegToRad(limits::kMinTriangulationAngleDeg);
  for (size_t i = 0; i < views.size(); ++i) {
    for (size_t j = 0; j < i; ++j) {
      const double angle = CalculateTriangulationAngle(views[i]->center, views[j]->center, xyz);
      if (angle >= kMinAngleRad) return true;
    }
  }
  return false;
}

// For LO-RANSAC, minimal and local alike. Both arguments are the same views.
class Estimator {
 public:
  using X_t = const TriangulationView*;
  using Y_t = const TriangulationView*;
  using M_t = Eigen::Vector3d;
  static const int kMinNumSamples = 2;

  std::vector<M_t> Estimate(const std::vector<X_t>& views, const std::vector<Y_t>&) const {
    const Eigen::Vector3d xyz =
        views.size() == 2 ? TriangulatePoint(views[0]->cam_from_world, views[1]->cam_from_world,
                                             views[0]->on_plane, views[1]->on_plane)
                          : TriangulateManyViews(views);
    if (!IsInFrontOfAll(views, xyz) || !HasAngle(views, xyz)) return {};
    return {xyz};
  }

  void Residuals(const std::vector<X_t>& views, const std::vector<Y_t>&, const M_t& xyz,
                 std::vector<double>* squared) const {
    squared->resize(views.size());
    for (size_t i = 0; i < views.size(); ++i) (*squared)[i] = SquaredError(*views[i], xyz);
  }

  TriangulationLimits limits;

 private:
  double SquaredError(const TriangulationView& view, const Eigen::Vector3d& xyz) const {
    if (limits.error == TriangulationLimits::Error::kReprojection) {
      return CalculateSquaredReprojectionError(view.pixel, xyz, view.cam_from_world, *view.camera);
    }
    const double angle = CalculateNormalizedAngularError(view.on_plane, xyz, view.cam_from_world);
    return angle * angle;
  }
};

colmap::RANSACOptions RansacOptions(double max_error, size_t num_views) {
  constexpr size_t kMaxExhaustive = 15;
  colmap::RANSACOptions options;
  options.max_error = max_error;
  options.confidence = 0.9999;
  options.min_inlier_ratio = 0.02;
  options.max_num_trials = 10000;
  if (num_views <= kMaxExhaustive) options.min_num_trials = num_views * (num_views - 1) / 2;
  return options;
}

}  // namespace

Eigen::Vector3d TriangulatePoint(const Matrix3x4d& cam1_from_world,
                                 const Matrix3x4d& cam2_from_world, const Eigen::Vector2d& point1,
                                 const Eigen::Vector2d& point2) {
  Eigen::Matrix4d A;
  A.row(0) = point1[0] * cam1_from_world.row(2) - cam1_from_world.row(0);
  A.row(1) = point1[1] * cam1_from_world.row(2) - cam1_from_world.row(1);
  A.row(2) = point2[0] * cam2_from_world.row(2) - cam2_from_world.row(0);
  A.row(3) = point2[1] * cam2_from_world.row(2) - cam2_from_world.row(1);
  const auto B = A.leftCols<3>();
  const Eigen::Matrix3d normal = B.transpose() * B;
  return -normal.inverse() * (B.transpose() * A.col(3));
}

double CalculateTriangulationAngle(const Eigen::Vector3d& center1, const Eigen::Vector3d& center2,
                                   const Eigen::Vector3d& point) {
  const double baseline2 = (center1 - center2).squaredNorm();
  const double ray1 = (point - center1).squaredNorm(), ray2 = (point - center2).squaredNorm();
  const double product = 2.0 * std::sqrt(ray1 * ray2);
  if (product == 0) return 0;
  const double angle = std::abs(std::acos((ray1 + ray2 - baseline2) / product));
  return std::min(angle, M_PI - angle);
}

bool EstimateTriangulation(const TriangulationLimits& limits,
                           const std::vector<TriangulationView>& views,
                           std::vector<char>* inlier_mask, Eigen::Vector3d* xyz) {
  using ForRansac = colmap_api::ForRansac<Estimator>;
  colmap::LORANSAC<ForRansac, ForRansac, colmap::InlierSupportMeasurer, colmap::CombinationSampler>
      ransac(RansacOptions(limits.max_error, views.size()));
  ransac.estimator.limits = ransac.local_estimator.limits = limits;
  std::vector<const TriangulationView*> pointers;
  pointers.reserve(views.size());
  for (const TriangulationView& view : views) pointers.push_back(&view);
  auto report = ransac.Estimate(pointers, pointers);
  if (!report.success) return false;
  *inlier_mask = std::move(report.inlier_mask);
  *xyz = report.model;
  return true;
}

}  // namespace skein
