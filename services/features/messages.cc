#include "features/messages.h"

#include <algorithm>

#include "ledger/fact_ids.h"

namespace skein {

features_t ToMessage(int64_t image_id, int64_t computed_at_seq, const PhotoDescription& photo,
                     const ResultBlobs& blobs) {
  features_t message{};
  message.header.fact_id = FeaturesFactId(image_id);
  message.header.computed_at_seq = computed_at_seq;
  message.image_id = image_id;
  message.num_keypoints = static_cast<int32_t>(photo.local.keypoints.size());
  message.keypoints_blob = blobs.keypoints;
  message.descriptors_blob = blobs.descriptors;
  message.global_blob = blobs.global;
  message.global_model = photo.global.model;
  message.blur = photo.quality.blur;
  message.brightness = photo.quality.brightness;
  message.coverage = photo.quality.coverage;
  const auto& bits = photo.quality.texture.bits;
  static_assert(sizeof message.texture == sizeof bits);
  std::copy(bits.begin(), bits.end(), message.texture);
  message.local_s = static_cast<float>(photo.local_s);
  message.global_s = static_cast<float>(photo.global_s);
  return message;
}

}  // namespace skein
