#include "session/guidance_json.h"

#include <algorithm>
#include <array>
#include <string>

#include "ledger/facts.h"

namespace skein {
namespace {

using nlohmann::json;

constexpr std::array<const char*, 4> kVerdicts = {"growing", "weak", "nearly", "complete"};
constexpr std::array<const char*, 6> kWhys = {"unknown",     "few_photos", "no_parallax",
                                              "too_slanted", "too_far",    "open_border"};

template <size_t kCount>
const char* NameOf(const std::array<const char*, kCount>& names, int8_t value) {
  return value >= 0 && value < static_cast<int>(kCount) ? names[value] : names[0];
}

// The reverse of PlaceJson.
completeness_t PlaceOf(const json& place) {
  const auto number = [&place](const char* name) {
    const auto found = place.find(name);
    return found != place.end() && found->is_number() ? found->get<double>() : 0.0;
  };
  const auto text = [&place](const char* name) {
    const auto found = place.find(name);
    return found != place.end() && found->is_string() ? found->get<std::string>() : std::string();
  };
  const auto count = [&number](const char* name) {
    return static_cast<int32_t>(std::clamp(number(name), 0.0, 1e9));
  };
  completeness_t told{};
  told.num_photos = count("photos");
  told.num_surfels = count("surfels");
  told.num_open = count("open");
  told.area = number("area");
  told.good_share = static_cast<float>(number("good_share"));
  told.open_share = static_cast<float>(number("open_share"));
  told.median_sigma = number("median_sigma");
  told.target_gsd = number("target_gsd");
  told.metres_per_unit = number("metres_per_unit");
  const auto verdict = std::find(kVerdicts.begin(), kVerdicts.end(), text("verdict"));
  told.verdict = verdict == kVerdicts.end() ? 0 : static_cast<int8_t>(verdict - kVerdicts.begin());
  told.sentence = ClampText(text("sentence"));
  return told;
}

json StationJson(const station_t& station) {
  json pose = json::array();
  for (const float value : station.cam_from_world_qwxyz) pose.push_back(value);
  for (const float value : station.cam_from_world_xyz) pose.push_back(value);
  return {{"pose", std::move(pose)},
          {"target", {station.target[0], station.target[1], station.target[2]}},
          {"gain", station.gain},
          {"common_points", station.common_points},
          {"why", NameOf(kWhys, station.why)},
          {"nearest", station.nearest_image_id},
          {"offset", {station.right, station.down, station.forward}},
          {"sentence", station.sentence}};
}

}  // namespace

json PlaceJson(const completeness_t& place) {
  return {{"photos", place.num_photos},
          {"surfels", place.num_surfels},
          {"open", place.num_open},
          {"area", place.area},
          {"good_share", place.good_share},
          {"open_share", place.open_share},
          {"median_sigma", place.median_sigma},
          {"target_gsd", place.target_gsd},
          {"metres_per_unit", place.metres_per_unit},
          {"verdict", NameOf(kVerdicts, place.verdict)},
          {"sentence", place.sentence}};
}

json GuidanceJson(const guidance_t& guidance) {
  json told = PlaceJson(guidance.place);
  told["submap"] = guidance.submap_id;
  told["version"] = guidance.version;
  return told;
}

std::map<int64_t, guidance_t> PlacesOfReport(const json& report) {
  std::map<int64_t, guidance_t> places;
  const json submaps = report.is_object() ? report.value("submaps", json::array()) : json::array();
  for (const json& submap : submaps) {
    if (!submap.is_object() || !submap.contains("id") || !submap["id"].is_number_integer())
      continue;
    const json place = submap.value("completeness", json());
    if (!place.is_object() || !place.contains("verdict")) continue;
    guidance_t guidance{};
    guidance.submap_id = submap["id"];
    guidance.place = PlaceOf(place);
    places[guidance.submap_id] = guidance;
  }
  return places;
}

json AdviceJson(const advice_t& advice) {
  json stations = json::array();
  for (const station_t& station : advice.stations) stations.push_back(StationJson(station));
  return {{"agent", advice.agent},
          {"submap", advice.submap_id},
          {"version", advice.version},
          {"last_photo", advice.last_image_id},
          {"working_distance", advice.working_distance},
          {"metres_per_unit", advice.metres_per_unit},
          {"stations", std::move(stations)}};
}

}  // namespace skein
