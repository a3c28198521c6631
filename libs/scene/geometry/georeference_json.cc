#include "geometry/georeference_json.h"

#include <optional>

namespace skein {
namespace {

using nlohmann::json;

json OrNull(const std::optional<double>& value) { return value ? json(*value) : json(nullptr); }

json ResidualsToJson(const GeoreferenceSummary& summary) {
  return {{"rmse", summary.rmse_m},
          {"median", summary.median_m},
          {"max", summary.max_m},
          {"horizontal_rmse", summary.horizontal_rmse_m},
          {"vertical_rmse", OrNull(summary.vertical_rmse_m)}};
}

json SimilarityToJson(const Similarity& s) {
  return {{"scale", s.scale},
          {"rotation_wxyz", {s.rotation.w(), s.rotation.x(), s.rotation.y(), s.rotation.z()}},
          {"translation_m", {s.translation.x(), s.translation.y(), s.translation.z()}}};
}

}  // namespace

json GeoreferenceToJson(const GeoreferenceSummary& summary) {
  json result = {{"ok", summary.ok},
                 {"positions", summary.num_positions},
                 {"altitudes", summary.num_altitudes}};
  if (!summary.ok) {
    result["reason"] = summary.reason;
    return result;
  }
  json outliers = json::array();
  for (const GeoOutlier& outlier : summary.outliers) {
    outliers.push_back({{"image", outlier.name}, {"residual_m", outlier.residual_m}});
  }
  result["origin"] = {{"latitude_deg", summary.origin.latitude_deg},
                      {"longitude_deg", summary.origin.longitude_deg},
                      {"altitude_m", OrNull(summary.origin.altitude_m)}};
  result["enu_from_model"] = SimilarityToJson(summary.enu_from_model);
  result["inliers"] = summary.num_inliers;
  result["altitudes_used"] = summary.altitudes_used;
  result["residual_m"] = ResidualsToJson(summary);
  result["rotation_sigma_deg"] = summary.rotation_sigma_deg;
  result["scale_sigma"] = summary.scale_sigma;
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
