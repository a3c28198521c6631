#include "web/diagnosis_json.h"

#include <nlohmann/json.hpp>

#include "core/limits.h"
#include "web/events.h"

namespace skein {

nlohmann::json DiagnosisJson(const SessionState& state, const PhotoState& photo,
                             const Diagnosis& diagnosis) {
  constexpr int kShareDigits = 3;
  const features_t& features = photo.features;
  const int64_t other_id = diagnosis.best_other_id;
  return {{"cause", CauseName(diagnosis.cause)},
          {"reason", diagnosis.reason},
          {"inliers", diagnosis.num_inliers},
          {"needed", limits::kMinPoseInliers},
          {"other", other_id == 0 ? "" : state.NameOf(other_id)},
          {"brightness", Rounded(features.brightness, kShareDigits)},
          {"blur", Rounded(features.blur, kShareDigits)},
          {"coverage", Rounded(features.coverage, kShareDigits)},
          {"keypoints", features.num_keypoints}};
}

}  // namespace skein
