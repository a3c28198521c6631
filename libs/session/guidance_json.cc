#include "session/guidance_json.h"

#include <algorithm>
#include <array>
#include <string>

#include "core/finite.h"
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
guidance_t PlaceOf(const json& place) {
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
  guidance_t guidance{};
  guidance.num_photos = count("photos");
  guidance.num_surfels = count("surfels");
  guidance.num_open = count("open");
  guidance.area = number("area");
  guidance.good_share = static_cast<float>(number("good_share"));
  guidance.open_share = static_cast<float>(number("open_share"));
  guidance.median_sigma = number("median_sigma");
  guidance.target_gsd = number("target_gsd");
  guidance.metres_per_unit = number("metres_per_unit");
  const auto verdict = std::find(kVerdicts.begin(), kVerdicts.end(), text("verdict"));
  guidance.verdict =
      verdict == kVerdicts.end() ? 0 : static_cast<int8_t>(verdict - kVerdicts.begin());
  guidance.sentence = ClampText(text("sentence"));
  return guidance;
}

json StationJson(const station_t& station) {
  json pose = json::array();
  for (const float value : station.qvec) pose.push_back(value);
  for (const float value : station.tvec) pose.push_back(value);
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

guidance_t ToMessage(const PlaceSummary& place, double metres_per_unit) {
  const Completeness& completeness = place.completeness;
  guidance_t message{};
  message.num_photos = static_cast<int32_t>(place.num_photos);
  message.num_surfels = static_cast<int32_t>(place.num_surfels);
  message.num_open = static_cast<int32_t>(place.num_open);
  message.area = FiniteOrZero(completeness.area);
  message.good_share = static_cast<float>(FiniteOrZero(completeness.good_share));
  message.open_share = static_cast<float>(FiniteOrZero(completeness.open_share));
  message.median_sigma = FiniteOrZero(completeness.median_sigma);
  message.target_gsd = FiniteOrZero(completeness.target_gsd);
  message.metres_per_unit = FiniteOrZero(metres_per_unit);
  message.verdict = static_cast<int8_t>(place.verdict);
  message.sentence = ClampText(place.sentence);
  return message;
}

json PlaceJson(const guidance_t& guidance) {
  return {{"photos", guidance.num_photos},
          {"surfels", guidance.num_surfels},
          {"open", guidance.num_open},
          {"area", guidance.area},
          {"good_share", guidance.good_share},
          {"open_share", guidance.open_share},
          {"median_sigma", guidance.median_sigma},
          {"target_gsd", guidance.target_gsd},
          {"metres_per_unit", guidance.metres_per_unit},
          {"verdict", NameOf(kVerdicts, guidance.verdict)},
          {"sentence", guidance.sentence}};
}

json GuidanceJson(const guidance_t& guidance) {
  json told = PlaceJson(guidance);
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
    guidance_t guidance = PlaceOf(place);
    guidance.submap_id = submap["id"];
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
