#pragma once

// Between Skein's messages and matching.

#include <cstdint>
#include <string>

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

}  // namespace skein
