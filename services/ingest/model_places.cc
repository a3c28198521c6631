#include "ingest/model_places.h"

#include <filesystem>
#include <utility>
#include <vector>

#include "core/file.h"
#include "geometry/georeference_json.h"
#include "geometry/model_poses.h"
#include "guidance/guided_map.h"
#include "guidance/model_map.h"
#include "guidance/place_summary.h"
#include "ingest/model_writer.h"
#include "session/guidance_json.h"
#include "sfm/model_io.h"

namespace skein {
namespace {

namespace fs = std::filesystem;

Georeference PlaceModel(const fs::path& folder, const GeodeticPosition& origin,
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

Result<Reconstruction> ReadWhole(const fs::path& folder) {
  ModelArchive archive;
  for (const char* name : kModelFiles) {
    Result<Bytes> bytes = ReadFile((folder / name).string());
    if (!bytes.ok()) return bytes.status();
    archive[name] = std::move(*bytes);
  }
  return DecodeModel(std::move(archive));
}

nlohmann::json CompletenessOf(const fs::path& folder, const Georeference& earth,
                              const PlacePhotos& photos, double target_gsd_mm) {
  const Result<Reconstruction> model = ReadWhole(folder);
  if (!model.ok()) return {{"reason", model.error()}};
  const double metres_per_unit = earth.ok ? earth.enu_from_model.scale : 0;
  const double target_gsd =
      earth.ok && target_gsd_mm > 0 ? TargetGsd(target_gsd_mm, metres_per_unit) : 0;
  GuidedMap map = MapOfModel(*model, kMaxGuidedPoints);
  for (GuidedPhoto& photo : map.photos) {
    const auto texture = photos.textures.find(photo.image_id);
    if (texture != photos.textures.end()) photo.texture = texture->second;
  }
  const PlaceSummary place = SummarisePlace(AssessPlace(map, target_gsd), map.photos.size());
  return PlaceJson(ToMessage(place, metres_per_unit));
}

}  // namespace

void AddPlaces(const SessionPaths& paths, const PlacePhotos& photos, double target_gsd_mm,
               nlohmann::json* report) {
  std::vector<GeodeticPosition> all;
  for (const auto& [name, position] : photos.positions) all.push_back(position);
  const GeodeticPosition origin = EnuOrigin(all);
  nlohmann::json& submaps = (*report)["submaps"];
  for (size_t i = 0; i < submaps.size(); ++i) {
    const fs::path folder = paths.Sparse() / std::to_string(i);
    const Georeference earth = PlaceModel(folder, origin, photos.positions);
    submaps[i]["georeference"] = GeoreferenceToJson(earth);
    submaps[i]["completeness"] = CompletenessOf(folder, earth, photos, target_gsd_mm);
  }
}

}  // namespace skein
