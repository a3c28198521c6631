#include "sfm/sensor_width.h"

#include "sfm/colmap_api.h"

namespace skein {

std::optional<double> FindSensorWidthMm(const std::string& make, const std::string& model) {
  double width_mm = 0;
  colmap::CameraDatabase cameras;
  if (!cameras.QuerySensorWidth(make, model, &width_mm)) return std::nullopt;
  return width_mm;
}

}  // namespace skein
