#include "guide/place_guidance.h"

#include <algorithm>
#include <optional>
#include <utility>

#include "guide/sentences.h"
#include "session/session_state.h"

namespace skein {
namespace {

// Where the model lies on the earth; nothing where GPS does not tell.
std::optional<Georeference> Locate(const PlaceInput& input, const GuidedMap& map) {
  std::vector<GeodeticPosition> positions;
  std::vector<GeoPhoto> photos;
  for (const GuidedPhoto& photo : map.photos) {
    const auto known = input.photos.find(photo.image_id);
    if (known == input.photos.end() || !known->second.has_position) continue;
    positions.push_back(known->second.position);
    photos.push_back({known->second.name, photo.cam_from_world, known->second.position});
  }
  if (photos.empty()) return std::nullopt;
  Georeference found = EstimateGeoreference(EnuOrigin(positions), photos);
  if (!found.ok) return std::nullopt;
  return found;
}

void SetTextures(const PlaceInput& input, ShapeMap* map) {
  for (size_t i = 0; i < map->map().photos.size(); ++i) {
    const auto known = input.photos.find(map->map().photos[i].image_id);
    if (known != input.photos.end()) map->SetTexture(i, known->second.texture);
  }
}

// Nothing where the limits are not known in the model's frame.
std::optional<Reach> ReachOf(const GuideOptions& options, const NoGoAreas& no_go,
                             const std::optional<Georeference>& earth) {
  Reach reach;
  if (!earth)
    return options.altitude.empty() && no_go.empty() ? std::optional(reach) : std::nullopt;
  const Similarity& enu_from_model = earth->enu_from_model;
  const Similarity model_from_enu = enu_from_model.Inverse();
  reach.up = enu_from_model.rotation.conjugate() * Eigen::Vector3d::UnitZ();
  if (!options.altitude.empty()) {
    if (!earth->altitudes_used || !earth->origin.altitude_m) return std::nullopt;
    // up_enu = scale * up . x + translation.z
    const AltitudeRange range = *ParseAltitude(options.altitude);
    const double base_m = *earth->origin.altitude_m + enu_from_model.translation.z();
    reach.min_height = (range.min_m - base_m) / enu_from_model.scale;
    reach.max_height = (range.max_m - base_m) / enu_from_model.scale;
  }
  for (const std::vector<GeodeticPosition>& area : no_go) {
    reach.no_go.emplace_back();
    for (GeodeticPosition corner : area) {
      corner.altitude_m = earth->origin.altitude_m;
      reach.no_go.back().push_back(model_from_enu.Apply(EnuFromGeodetic(earth->origin, corner)));
    }
  }
  return reach;
}

// Agents by number, from 1.
struct Agents {
  std::vector<std::string> names{""};
  std::map<int64_t, int32_t> of_image;
};

Agents NumberAgents(const std::map<int64_t, GuidePhoto>& photos) {
  Agents agents;
  std::map<std::string, int32_t> numbers;
  for (const auto& [image_id, photo] : photos) {
    const auto [number, is_new] =
        numbers.try_emplace(photo.agent, static_cast<int32_t>(agents.names.size()));
    if (is_new) agents.names.push_back(photo.agent);
    agents.of_image[image_id] = number->second;
  }
  return agents;
}

// Of the agents that ask, in the order of their numbers.
std::vector<StationSeeker> SeekersOf(const PlaceInput& input, const Agents& agents,
                                     const GuidedMap& map, const Reach& reach) {
  std::map<int32_t, uint32_t> last_photos;
  for (uint32_t i = 0; i < map.photos.size(); ++i) {
    const auto [last, is_first] = last_photos.try_emplace(map.photos[i].agent, i);
    if (map.photos[i].image_id > map.photos[last->second].image_id) last->second = i;
  }
  std::vector<StationSeeker> seekers;
  for (const auto& [agent, last_photo] : last_photos) {
    if (input.agents.count(agents.names[agent]) == 0) continue;
    const auto in_vain = input.in_vain.find(agents.names[agent]);
    seekers.push_back({agent, last_photo, reach, {}});
    if (in_vain != input.in_vain.end()) seekers.back().in_vain = in_vain->second;
  }
  return seekers;
}

AdvisedStation Advise(const PlaceInput& input, const GuidedMap& map, const Wording& wording,
                      const Station& station) {
  const GuidedPhoto& near = map.photos[station.nearest_photo];
  const auto known = input.photos.find(near.image_id);
  const std::string name = known == input.photos.end()
                               ? "photo " + std::to_string(near.image_id)
                               : PhotoName(known->second.agent, known->second.name);
  AdvisedStation advised;
  advised.station = station;
  advised.nearest_image_id = near.image_id;
  advised.offset = near.cam_from_world.Apply(station.cam_from_world.Centre());
  advised.sentence = StationSentence(wording, name, near.cam_from_world, station);
  return advised;
}

}  // namespace

PlaceGuide::PlaceGuide(const GuideOptions& options, const NoGoAreas& no_go)
    : options_(options), no_go_(no_go) {}

Result<PlaceGuidance> PlaceGuide::Update(const PlaceInput& input) {
  const Agents agents = NumberAgents(input.photos);
  Status taken = shape_map_.Update(*input.shape, agents.of_image, kMaxGuidedPoints);
  if (!taken.ok()) return taken;
  SetTextures(input, &shape_map_);
  const GuidedMap& map = shape_map_.map();
  const std::optional<Georeference> earth = Locate(input, map);

  PlaceGuidance guidance;
  guidance.submap_id = input.shape->submap_id;
  guidance.version = input.shape->version;
  guidance.metres_per_unit = earth ? earth->enu_from_model.scale : 0;

  const double target_gsd = earth && options_.target_gsd_mm > 0
                                ? TargetGsd(options_.target_gsd_mm, guidance.metres_per_unit)
                                : 0;
  const PlaceQuality& place = place_.Update(map, target_gsd);
  guidance.place = SummarisePlace(place, map.photos.size());
  guidance.working_distance = place.surface.working_distance;

  const std::optional<Reach> reach = ReachOf(options_, no_go_, earth);
  const std::vector<StationSeeker> seekers = SeekersOf(input, agents, map, reach.value_or(Reach()));
  std::vector<std::vector<Station>> stations(seekers.size());
  if (reach && place.surface.cell > 0) {
    stations = ChooseStations(place_.map(), place, seekers, kMinStationPoints * shape_map_.share());
  }
  Wording wording;
  wording.up = reach && !reach->up.isZero() ? reach->up : UpOf(map);
  wording.metres_per_unit = guidance.metres_per_unit;
  wording.working_distance = guidance.working_distance;
  for (size_t i = 0; i < seekers.size(); ++i) {
    AgentAdvice advice;
    advice.agent = agents.names[seekers[i].agent];
    advice.last_image_id = map.photos[seekers[i].last_photo].image_id;
    for (Station& station : stations[i]) {
      station.common_points /= shape_map_.share();
      advice.stations.push_back(Advise(input, map, wording, station));
    }
    guidance.advice.push_back(std::move(advice));
  }
  return guidance;
}

}  // namespace skein
