#pragma once

// Between Skein's messages and matching.

#include <cstdint>
#include <string>
#include <vector>

#include "core/result.h"
#include "matching/photo_matches.h"
#include "sfm/camera.h"
#include "skein/image_t.hpp"
#include "skein/matches_t.hpp"

namespace skein {

// Fails unless size and focal length are positive.
Result<Camera> CameraFromMessage(const image_t& image);

// All but the header's session, author and position. `pairs_blob` names the encoded matches.pairs.
matches_t ToMessage(int64_t image_id, const PhotoMatches& matches, const std::string& pairs_blob);

// Makes it one of matches_t's parts. `tried`: by this part. A first part names those in no pair.
void SetPart(int8_t part, const std::vector<int64_t>& tried, matches_t* message);

}  // namespace skein
