#include "guidance/guided_map.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

namespace skein {

bool GuidedCamera::Project(const Eigen::Vector3d& in_camera, Eigen::Vector2d* pixel) const {
  if (in_camera.z() <= 0) return false;
  *pixel = {fx_px * in_camera.x() / in_camera.z() + cx_px,
            fy_px * in_camera.y() / in_camera.z() + cy_px};
  return pixel->x() >= 0 && pixel->y() >= 0 && pixel->x() < width_px && pixel->y() < height_px;
}

Eigen::Vector3d AheadOf(const CameraPose& pose) {
  return pose.rotation.conjugate() * Eigen::Vector3d::UnitZ();
}
Eigen::Vector3d RightOf(const CameraPose& pose) {
  return pose.rotation.conjugate() * Eigen::Vector3d::UnitX();
}
Eigen::Vector3d UpperSideOf(const CameraPose& pose) {
  return -(pose.rotation.conjugate() * Eigen::Vector3d::UnitY());
}

double HowFar(const CameraPose& from, const CameraPose& to, double working_distance) {
  const double turn = std::acos(std::clamp(AheadOf(from).dot(AheadOf(to)), -1.0, 1.0));
  return (from.Centre() - to.Centre()).norm() / working_distance + turn;
}

Eigen::Vector3d UpOf(const GuidedMap& map) {
  constexpr double kAgreement = 0.7;  // length of a mean of unit vectors, cosine of one with it
  constexpr double kLevel = 0.01;     // (0.1 rad)^2: how level photos are held
  Eigen::Vector3d upper_side = Eigen::Vector3d::Zero(), back = Eigen::Vector3d::Zero();
  for (const GuidedPhoto& photo : map.photos) {
    upper_side += UpperSideOf(photo.cam_from_world);
    back -= AheadOf(photo.cam_from_world);
  }
  const double count = static_cast<double>(std::max<size_t>(1, map.photos.size()));
  const bool level = upper_side.norm() >= kAgreement * count || upper_side.norm() >= back.norm();
  const Eigen::Vector3d mean = level ? upper_side : back;
  if (mean.norm() < 1e-9) return {0, 0, 1};
  const Eigen::Vector3d direction = mean.normalized();
  Eigen::Matrix3d across = count * kLevel * Eigen::Matrix3d::Identity();
  for (const GuidedPhoto& photo : map.photos) {
    const CameraPose& pose = photo.cam_from_world;
    const Eigen::Vector3d upwards = level ? UpperSideOf(pose) : Eigen::Vector3d(-AheadOf(pose));
    if (upwards.dot(direction) < kAgreement) continue;
    const Eigen::Vector3d right = RightOf(pose);
    across += right * right.transpose();
  }
  return across.ldlt().solve(direction).normalized();
}

}  // namespace skein
