#include "export/simple_camera.h"

#include <cmath>
#include <string>

namespace skein {
namespace {

constexpr double kMaxOffCentrePx = 1;

}  // namespace

Status ExpectSimpleCamera(const Camera& camera, const std::string& format) {
  const std::string& name = camera.ModelName();
  const std::string who = format + " cannot hold camera " + std::to_string(camera.CameraId());
  const bool is_simple = name == "SIMPLE_RADIAL" || name == "SIMPLE_PINHOLE" ||
                         (format == "bundler" && name == "RADIAL");
  if (!is_simple) {
    return InvalidArgument(who + " (" + name +
                           "): map the photos with camera_model = \"SIMPLE_RADIAL\" in [mapper]");
  }
  const double off_px = std::hypot(camera.PrincipalPointX() - camera.Width() / 2.0,
                                   camera.PrincipalPointY() - camera.Height() / 2.0);
  if (off_px <= kMaxOffCentrePx) return Status::Ok();
  return InvalidArgument(who + ": its principal point is " +
                         std::to_string(static_cast<int>(std::lround(off_px))) +
                         " px from the middle of the photo");
}

}  // namespace skein
