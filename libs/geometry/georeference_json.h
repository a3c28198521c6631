#pragma once

#include <nlohmann/json.hpp>

#include "geometry/georeference.h"

namespace skein {

// {"ok": true, "origin": {latitude_deg, longitude_deg, altitude_m}, "enu_from_model": {scale,
//  rotation_wxyz, translation_m}, "positions", "inliers", "altitudes_used", "residual_m": {rmse,
//  median, max, horizontal_rmse, vertical_rmse} of the inliers (rmse, median, max horizontal where
//  altitudes are not used), "rotation_sigma_deg", "scale_sigma", "outliers":
//  [{image, residual_m}]}; or {"ok": false, "reason", "positions"}.
// x_enu = scale * R(rotation) * x_model + translation.
nlohmann::json GeoreferenceToJson(const Georeference& georeference);

}  // namespace skein
