// What the guide tells, as JSON for commands and the page.
#pragma once

#include <nlohmann/json.hpp>

#include "skein/advice_t.hpp"
#include "skein/guidance_t.hpp"

namespace skein {

// {submap, version, photos, surfels, open, area, good_share, open_share, median_sigma, target_gsd,
//  metres_per_unit, verdict: growing|weak|nearly|complete, sentence}
nlohmann::json GuidanceJson(const guidance_t& guidance);

// {agent, submap, version, last_photo, working_distance, metres_per_unit,
//  stations[{pose[7], target[3], gain, common_points, why, nearest, offset[3], sentence}]}
// pose: cam_from_world, qw qx qy qz tx ty tz. nearest: an image_id. offset: right, down, forward in
// that photo's camera frame. Lengths in submap units.
nlohmann::json AdviceJson(const advice_t& advice);

}  // namespace skein
