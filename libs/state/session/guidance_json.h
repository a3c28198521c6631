// Guidance of a place and advice of the guide, as messages and as JSON.
#pragma once

#include <cstdint>
#include <map>
#include <nlohmann/json.hpp>

#include "skein/advice_t.hpp"
#include "skein/completeness_t.hpp"
#include "skein/guidance_t.hpp"

namespace skein {

// {photos, surfels, open, area, good_share, open_share, median_sigma, target_gsd, metres_per_unit,
//  verdict: growing|weak|nearly|complete, sentence}; of a guidance with its submap and version,
//  too.
nlohmann::json PlaceJson(const completeness_t& place);
nlohmann::json GuidanceJson(const guidance_t& guidance);

// The places of a report.json, by submap: those with a completeness. A field that is missing or of
// another type is 0.
std::map<int64_t, guidance_t> PlacesOfReport(const nlohmann::json& report);

// {agent, submap, version, last_photo, working_distance, metres_per_unit,
//  stations[{pose[7], target[3], gain, common_points, why, nearest, offset[3], sentence}]}
// pose: cam_from_world, qw qx qy qz tx ty tz. nearest: an image_id. offset: right, down, forward in
// that photo's camera frame. Lengths in submap units.
nlohmann::json AdviceJson(const advice_t& advice);

}  // namespace skein
