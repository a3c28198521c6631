#include "guidance/guided_map.h"

#include <algorithm>

namespace skein {

bool GuidedCamera::Project(const Eigen::Vector3d& in_camera, Eigen::Vector2d* pixel) const {
  if (in_camera.z() <= 0) return false;
  *pixel = {fx_px * in_camera.x() / in_camera.z() + cx_px,
            fy_px * in_camera.y() / in_camera.z() + cy_px};
  return pixel->x() >= 0 && pixel->y() >= 0 && pixel->x() < width_px && pixel->y() < height_px;
}

Eigen::Vector3d UpOf(const GuidedMap& map) {
  constexpr double kAgreement = 0.7;  // length of a mean of unit vectors
  Eigen::Vector3d upper_side = Eigen::Vector3d::Zero(), back = Eigen::Vector3d::Zero();
  for (const GuidedPhoto& photo : map.photos) {
    upper_side -= photo.cam_from_world.rotation.conjugate() * Eigen::Vector3d::UnitY();
    back -= photo.cam_from_world.rotation.conjugate() * Eigen::Vector3d::UnitZ();
  }
  const double count = static_cast<double>(std::max<size_t>(1, map.photos.size()));
  const bool level = upper_side.norm() >= kAgreement * count || upper_side.norm() >= back.norm();
  const Eigen::Vector3d up = level ? upper_side : back;
  return up.norm() < 1e-9 ? Eigen::Vector3d(0, 0, 1) : up.normalized();
}

}  // namespace skein
