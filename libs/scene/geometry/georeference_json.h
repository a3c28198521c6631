#pragma once

#include <nlohmann/json.hpp>

#include "geometry/georeference_summary.h"

namespace skein {

// Either
//
//   {"ok": true, "origin": {latitude_deg, longitude_deg, altitude_m},
//    "enu_from_model": {scale, rotation_wxyz, translation_m}, "positions", "altitudes", "inliers",
//    "altitudes_used", "rotation_sigma_deg", "scale_sigma",
//    "residual_m": {rmse, median, max, horizontal_rmse, vertical_rmse},
//    "outliers": [{image, residual_m}]}
//
// or {"ok": false, "reason", "positions", "altitudes"}. Both count photos. If no photo has an
// altitude, the origin's is null and heights are above the median camera. residual_m is that of the
// inliers; where altitudes are not used rmse, median and max are horizontal, and without any
// vertical_rmse is null. x_enu = scale * R(rotation) * x_model + translation.
nlohmann::json GeoreferenceToJson(const GeoreferenceSummary& summary);

// The origin of a georeference that is ok.
GeodeticPosition OriginOf(const nlohmann::json& georeference);

}  // namespace skein
