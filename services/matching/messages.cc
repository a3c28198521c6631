#include "matching/messages.h"

#include <stdexcept>

#include "ledger/fact_ids.h"

namespace skein {

Result<Camera> CameraFromMessage(const image_t& image) {
  try {
    return PriorCamera(image.width_px, image.height_px, image.focal_px, image.focal_from_exif);
  } catch (const std::invalid_argument& error) {
    return DataLoss("image " + std::to_string(image.image_id) + ": " + error.what());
  }
}

matches_t ToMessage(int64_t image_id, const PhotoMatches& matches, const std::string& pairs_blob) {
  matches_t message{};
  message.header.seq = 0;
  message.header.utime_us = 0;
  message.header.computed_at_seq = 0;
  message.header.fact_id = MatchesFactId(image_id);
  message.image_id = image_id;
  message.num_tried = matches.num_tried;
  for (const TwoViewPair& pair : matches.pairs) {
    two_view_t two_view;
    two_view.other_id = pair.other_id;
    two_view.num_inliers = static_cast<int32_t>(pair.inliers.size());
    two_view.geometry = pair.geometry;
    two_view.tri_angle_rad = pair.tri_angle_rad;
    two_view.forward_motion = pair.forward_motion;
    message.pairs.push_back(two_view);
  }
  message.num_pairs = static_cast<int32_t>(message.pairs.size());
  message.pairs_blob = pairs_blob;
  message.match_s = static_cast<float>(matches.match_s);
  message.verify_s = static_cast<float>(matches.verify_s);
  return message;
}

}  // namespace skein
