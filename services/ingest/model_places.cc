#include "ingest/model_places.h"

#include <filesystem>
#include <vector>

#include "geometry/georeference_json.h"
#include "geometry/model_poses.h"

namespace skein {
namespace {

Georeference PlaceModel(const std::filesystem::path& folder, const GeodeticPosition& origin,
                        const PhotoPositions& positions) {
  const Result<ModelPoses> model = ReadColmapPoses(folder);
  if (!model) {
    Georeference unreadable;
    unreadable.reason = model.error();
    return unreadable;
  }
  std::vector<GeoPhoto> photos;
  for (const NamedPose& pose : model->poses) {
    const auto position = positions.find(pose.name);
    if (position == positions.end()) continue;
    photos.push_back({pose.name, pose.pose, position->second});
  }
  return EstimateGeoreference(origin, photos);
}

}  // namespace

void AddGeoreferences(const SessionPaths& paths, const PhotoPositions& positions,
                      nlohmann::json* report) {
  std::vector<GeodeticPosition> all;
  for (const auto& [name, position] : positions) all.push_back(position);
  const GeodeticPosition origin = EnuOrigin(all);
  nlohmann::json& submaps = (*report)["submaps"];
  for (size_t i = 0; i < submaps.size(); ++i) {
    submaps[i]["georeference"] =
        GeoreferenceToJson(PlaceModel(paths.Sparse() / std::to_string(i), origin, positions));
  }
}

}  // namespace skein
