#include "clients/export/surface_quality.h"

#include <algorithm>
#include <cmath>
#include <iomanip>
#include <sstream>
#include <vector>

#include "depth/coloured_map.h"

namespace skein {
namespace {

constexpr int kDigits = 3;  // of a length for a person

double ShareOf(int64_t count, const DepthCounts& depths) {
  return static_cast<double>(count) / static_cast<double>(std::max<int64_t>(1, depths.Sum()));
}

std::string Percent(int64_t count, const DepthCounts& depths) {
  return std::to_string(std::lround(100 * ShareOf(count, depths))) + " %";
}

std::string Length(double length, bool in_metres) {
  std::ostringstream text;
  text << std::setprecision(kDigits) << length << (in_metres ? " m" : "");
  return text.str();
}

}  // namespace

SurfaceQuality QualityOf(const ModelDepths& depths, bool in_metres) {
  std::vector<ColouredMap> maps;
  for (size_t i = 0; i < depths.maps.size(); ++i) {
    maps.push_back({&depths.maps[i], &depths.colours[i], nullptr});
  }
  SurfaceQuality quality;
  quality.num_photos = depths.maps.size();
  quality.in_metres = in_metres;
  quality.depths = SumOf(depths.counts);
  quality.expected_error = PercentilesOfErrors(depths.maps);
  quality.completeness = MeanCompleteness(depths.maps);
  quality.ground_sampling_distance = GroundSamplingDistance(maps);
  return quality;
}

nlohmann::json ToJson(const DepthCounts& counts) {
  return {
      {"agreed", counts.agreed}, {"contradicted", counts.contradicted}, {"alone", counts.alone}};
}

nlohmann::json ToJson(const SurfaceQuality& quality) {
  const DepthCounts& depths = quality.depths;
  nlohmann::json json = {{"photos", quality.num_photos},
                         {"unit", quality.in_metres ? "m" : "model"},
                         {"depths", depths.Sum()},
                         {"agreed", ShareOf(depths.agreed, depths)},
                         {"contradicted", ShareOf(depths.contradicted, depths)},
                         {"alone", ShareOf(depths.alone, depths)},
                         {"expected_error_p50", quality.expected_error.p50},
                         {"expected_error_p95", quality.expected_error.p95},
                         {"completeness", quality.completeness},
                         {"ground_sampling_distance", quality.ground_sampling_distance},
                         {"mesh_voxel", nullptr}};
  if (quality.mesh_voxel) json["mesh_voxel"] = *quality.mesh_voxel;
  return json;
}

std::map<std::string, std::string> TextsOf(const SurfaceQuality& quality) {
  std::map<std::string, std::string> texts;
  const nlohmann::json json = ToJson(quality);
  for (const auto& [key, value] : json.items()) {
    if (!value.is_null()) texts[key] = value.is_string() ? value.get<std::string>() : value.dump();
  }
  return texts;
}

std::string LineOf(const SurfaceQuality& quality) {
  const DepthCounts& depths = quality.depths;
  return Percent(depths.agreed, depths) + " of " + std::to_string(depths.Sum()) +
         " depths agree with two other photos, " + Percent(depths.contradicted, depths) +
         " are contradicted, " + Percent(depths.alone, depths) + " stand alone; expected error " +
         Length(quality.expected_error.p50, quality.in_metres) + " in the median, " +
         Length(quality.expected_error.p95, quality.in_metres) +
         " in the 95th percentile, a pixel " +
         Length(quality.ground_sampling_distance, quality.in_metres) + " wide on the ground";
}

}  // namespace skein
