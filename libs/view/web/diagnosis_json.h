// Cause of a photo's absence from every map, with its figures. The page finds the words
// (web/src/words.js).
#pragma once

#include <nlohmann/json_fwd.hpp>

#include "session/diagnosis.h"

namespace skein {

// {cause: CauseName, reason, inliers, needed: inliers of a pose, other: name of the best pair's
// photo or "", brightness, blur, coverage, keypoints}
nlohmann::json DiagnosisJson(const SessionState& state, const PhotoState& photo,
                             const Diagnosis& diagnosis);

}  // namespace skein
