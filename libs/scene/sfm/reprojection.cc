#include "sfm/reprojection.h"

#include <Eigen/Geometry>
#include <cmath>
#include <limits>

#include "sfm/pose.h"

namespace skein {
namespace {

constexpr double kMinPositiveDepth = std::numeric_limits<double>::epsilon();

double Angle(const Eigen::Vector3d& ray1, const Eigen::Vector3d& ray2) {
  return std::acos(ray1.normalized().dot(ray2.normalized()));
}

}  // namespace

double CalculateSquaredReprojectionError(const Eigen::Vector2d& pixel, const Eigen::Vector3d& point,
                                         const Eigen::Vector4d& qvec, const Eigen::Vector3d& tvec,
                                         const Camera& camera) {
  const Eigen::Vector3d in_camera = QuaternionRotatePoint(qvec, point) + tvec;
  if (in_camera.z() < kMinPositiveDepth) return std::numeric_limits<double>::max();
  return (camera.WorldToImage(in_camera.hnormalized()) - pixel).squaredNorm();
}

double CalculateSquaredReprojectionError(const Eigen::Vector2d& pixel, const Eigen::Vector3d& point,
                                         const Matrix3x4d& cam_from_world, const Camera& camera) {
  const double z = cam_from_world.row(2).dot(point.homogeneous());
  if (z < kMinPositiveDepth) return std::numeric_limits<double>::max();
  const double inverse_z = 1.0 / z;
  const Eigen::Vector2d on_plane(inverse_z * cam_from_world.row(0).dot(point.homogeneous()),
                                 inverse_z * cam_from_world.row(1).dot(point.homogeneous()));
  return (camera.WorldToImage(on_plane) - pixel).squaredNorm();
}

double CalculateAngularError(const Eigen::Vector2d& pixel, const Eigen::Vector3d& point,
                             const Matrix3x4d& cam_from_world, const Camera& camera) {
  return CalculateNormalizedAngularError(camera.ImageToWorld(pixel), point, cam_from_world);
}

double CalculateAngularError(const Eigen::Vector2d& pixel, const Eigen::Vector3d& point,
                             const Eigen::Vector4d& qvec, const Eigen::Vector3d& tvec,
                             const Camera& camera) {
  return Angle(camera.ImageToWorld(pixel).homogeneous(), QuaternionRotatePoint(qvec, point) + tvec);
}

double CalculateNormalizedAngularError(const Eigen::Vector2d& on_plane,
                                       const Eigen::Vector3d& point,
                                       const Matrix3x4d& cam_from_world) {
  return Angle(on_plane.homogeneous(), cam_from_world * point.homogeneous());
}

bool HasPointPositiveDepth(const Matrix3x4d& cam_from_world, const Eigen::Vector3d& point) {
  return cam_from_world.row(2).dot(point.homogeneous()) >= kMinPositiveDepth;
}

}  // namespace skein
