#include "session/model_place.h"

#include <algorithm>
#include <cstddef>

#include "core/one_line.h"
#include "geometry/georeference_json.h"
#include "session/guidance_json.h"

namespace skein {
namespace {

using nlohmann::json;

std::string WhyNotTold(const submap_model_t& model) {
  return model.kind == submap_model_t::FINAL
             ? "the mapper failed at it"
             : "the model is a checkpoint: its mapper did not finish it";
}

GeoreferenceSummary SummaryOf(const SessionState& state, const georeference_t& told) {
  GeoreferenceSummary summary;
  summary.ok = told.ok != 0;
  summary.reason = told.reason;
  summary.num_positions = static_cast<size_t>(std::max(0, told.num_positions));
  summary.num_altitudes = static_cast<size_t>(std::max(0, told.num_altitudes));
  summary.origin = {told.latitude_deg, told.longitude_deg, {}};
  if (told.has_altitude) summary.origin.altitude_m = told.altitude_m;
  const double* q = told.rotation_qwxyz;
  summary.enu_from_model.scale = told.scale;
  summary.enu_from_model.rotation = Eigen::Quaterniond(q[0], q[1], q[2], q[3]);
  summary.enu_from_model.translation = Eigen::Vector3d(told.translation_m);
  summary.num_inliers = static_cast<size_t>(std::max(0, told.num_inliers));
  summary.altitudes_used = told.altitudes_used != 0;
  summary.rotation_sigma_deg = told.rotation_sigma_deg;
  summary.scale_sigma = told.scale_sigma;
  summary.rmse_m = told.rmse_m;
  summary.median_m = told.median_m;
  summary.max_m = told.max_m;
  summary.horizontal_rmse_m = told.horizontal_rmse_m;
  if (told.has_vertical_rmse) summary.vertical_rmse_m = told.vertical_rmse_m;
  for (int32_t i = 0; i < told.num_outliers; ++i) {
    summary.outliers.push_back({state.NameOf(told.outlier_images[i]), told.outlier_residuals_m[i]});
  }
  return summary;
}

}  // namespace

json CompletenessPart(const SubmapLife& submap) {
  const submap_model_t& model = *submap.latest_model;
  if (model.place.num_photos == 0) return {{"reason", WhyNotTold(model)}};
  return PlaceJson(model.place);
}

json GeoreferencePart(const SessionState& state, const SubmapLife& submap) {
  const submap_model_t& model = *submap.latest_model;
  GeoreferenceSummary summary = SummaryOf(state, model.georeference);
  if (!summary.ok && summary.reason.empty()) summary.reason = WhyNotTold(model);
  return GeoreferenceToJson(summary);
}

std::string PlaceSentenceOf(const SubmapLife& submap) {
  return submap.latest_model ? OneLine(submap.latest_model->place.sentence) : "";
}

}  // namespace skein
