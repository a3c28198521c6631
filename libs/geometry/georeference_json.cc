#include "geometry/georeference_json.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "core/statistics.h"

namespace skein {
namespace {

using nlohmann::json;

double Rms(const std::vector<double>& values) {
  double sum = 0;
  for (const double value : values) sum += value * value;
  return values.empty() ? 0.0 : std::sqrt(sum / static_cast<double>(values.size()));
}

json OrNull(const std::optional<double>& value) { return value ? json(*value) : json(nullptr); }

// Of what was used.
double Length(const Georeference& georeference, const GeoResidual& residual) {
  return georeference.altitudes_used ? residual.enu_m.norm() : residual.enu_m.head<2>().norm();
}

json ResidualsToJson(const Georeference& georeference) {
  std::vector<double> all, horizontal, vertical;
  for (const GeoResidual& residual : georeference.residuals) {
    if (!residual.inlier) continue;
    all.push_back(Length(georeference, residual));
    horizontal.push_back(residual.enu_m.head<2>().norm());
    if (residual.has_altitude) vertical.push_back(residual.enu_m.z());
  }
  return {{"rmse", Rms(all)},
          {"median", percentile(all, 50)},
          {"max", percentile(all, 100)},
          {"horizontal_rmse", Rms(horizontal)},
          {"vertical_rmse", vertical.empty() ? json(nullptr) : json(Rms(vertical))}};
}

json SimilarityToJson(const Similarity& s) {
  return {{"scale", s.scale},
          {"rotation_wxyz", {s.rotation.w(), s.rotation.x(), s.rotation.y(), s.rotation.z()}},
          {"translation_m", {s.translation.x(), s.translation.y(), s.translation.z()}}};
}

}  // namespace

json GeoreferenceToJson(const Georeference& georeference) {
  const auto num_altitudes =
      std::count_if(georeference.residuals.begin(), georeference.residuals.end(),
                    [](const GeoResidual& residual) { return residual.has_altitude; });
  json result = {{"ok", georeference.ok},
                 {"positions", georeference.residuals.size()},
                 {"altitudes", num_altitudes}};
  if (!georeference.ok) {
    result["reason"] = georeference.reason;
    return result;
  }
  json outliers = json::array();
  for (const GeoResidual& residual : georeference.residuals) {
    if (residual.inlier) continue;
    outliers.push_back({{"image", residual.name}, {"residual_m", Length(georeference, residual)}});
  }
  result["origin"] = {{"latitude_deg", georeference.origin.latitude_deg},
                      {"longitude_deg", georeference.origin.longitude_deg},
                      {"altitude_m", OrNull(georeference.origin.altitude_m)}};
  result["enu_from_model"] = SimilarityToJson(georeference.enu_from_model);
  result["inliers"] = georeference.num_inliers;
  result["altitudes_used"] = georeference.altitudes_used;
  result["residual_m"] = ResidualsToJson(georeference);
  result["rotation_sigma_deg"] = georeference.rotation_sigma_deg;
  result["scale_sigma"] = georeference.scale_sigma;
  result["outliers"] = outliers;
  return result;
}

GeodeticPosition OriginOf(const json& georeference) {
  const json& origin = georeference.at("origin");
  GeodeticPosition position{origin.at("latitude_deg"), origin.at("longitude_deg"), {}};
  if (!origin.at("altitude_m").is_null()) position.altitude_m = origin.at("altitude_m");
  return position;
}

}  // namespace skein
