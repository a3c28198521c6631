#include "guidance/guided_map.h"

namespace skein {

bool GuidedCamera::Project(const Eigen::Vector3d& in_camera, Eigen::Vector2d* pixel) const {
  if (in_camera.z() <= 0) return false;
  *pixel = {fx_px * in_camera.x() / in_camera.z() + cx_px,
            fy_px * in_camera.y() / in_camera.z() + cy_px};
  return pixel->x() >= 0 && pixel->y() >= 0 && pixel->x() < width_px && pixel->y() < height_px;
}

}  // namespace skein
