#include "geometry/georeference_summary.h"

#include <algorithm>
#include <cmath>

#include "core/statistics.h"

namespace skein {
namespace {

double Rms(const std::vector<double>& values) {
  double sum = 0;
  for (const double value : values) sum += value * value;
  return values.empty() ? 0.0 : std::sqrt(sum / static_cast<double>(values.size()));
}

// The residual's length, without the height where altitudes are not used.
double Length(const Georeference& georeference, const GeoResidual& residual) {
  return georeference.altitudes_used ? residual.enu_m.norm() : residual.enu_m.head<2>().norm();
}

void SetResiduals(const Georeference& georeference, GeoreferenceSummary* summary) {
  std::vector<double> all, horizontal, vertical;
  for (const GeoResidual& residual : georeference.residuals) {
    if (!residual.inlier) {
      summary->outliers.push_back({residual.name, Length(georeference, residual)});
      continue;
    }
    all.push_back(Length(georeference, residual));
    horizontal.push_back(residual.enu_m.head<2>().norm());
    if (residual.has_altitude) vertical.push_back(residual.enu_m.z());
  }
  summary->rmse_m = Rms(all);
  summary->median_m = percentile(all, 50);
  summary->max_m = percentile(all, 100);
  summary->horizontal_rmse_m = Rms(horizontal);
  if (!vertical.empty()) summary->vertical_rmse_m = Rms(vertical);
}

}  // namespace

GeoreferenceSummary Summarise(const Georeference& georeference) {
  GeoreferenceSummary summary;
  summary.ok = georeference.ok;
  summary.num_positions = georeference.residuals.size();
  summary.num_altitudes =
      std::count_if(georeference.residuals.begin(), georeference.residuals.end(),
                    [](const GeoResidual& residual) { return residual.has_altitude; });
  summary.reason = georeference.reason;
  if (!georeference.ok) return summary;
  summary.origin = georeference.origin;
  summary.enu_from_model = georeference.enu_from_model;
  summary.num_inliers = static_cast<size_t>(georeference.num_inliers);
  summary.altitudes_used = georeference.altitudes_used;
  summary.rotation_sigma_deg = georeference.rotation_sigma_deg;
  summary.scale_sigma = georeference.scale_sigma;
  SetResiduals(georeference, &summary);
  return summary;
}

}  // namespace skein
