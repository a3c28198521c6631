#include "matching/photo_index.h"

#include <unordered_set>

#include "matching/messages.h"

namespace skein {

const PhotoState* PhotoIndex::FindWithFeatures(int64_t image_id) const {
  const PhotoState* photo = session_.FindPhoto(image_id);
  const bool has = photo != nullptr && !photo->features.descriptors_blob.empty() &&
                   CameraFromMessage(photo->image).ok();
  return has ? photo : nullptr;
}

bool PhotoIndex::HasCandidates(int64_t image_id) const {
  const PhotoState* photo = session_.FindPhoto(image_id);
  return photo != nullptr && photo->candidates_seq > 0;
}

std::vector<int64_t> PhotoIndex::CandidatesOf(int64_t image_id) const {
  std::vector<int64_t> others;
  const PhotoState* photo = session_.FindPhoto(image_id);
  if (photo == nullptr) return others;
  std::unordered_set<int64_t> seen{image_id};
  for (const int64_t other_id : photo->candidates.other_ids) {
    const PhotoState* other = FindWithFeatures(other_id);
    if (other == nullptr || other->features_seq > photo->candidates_seq) continue;
    if (seen.insert(other_id).second) others.push_back(other_id);
  }
  return others;
}

bool PhotoIndex::IsEarlier(int64_t other_id, int64_t image_id) const {
  const PhotoState* other = FindWithFeatures(other_id);
  return other != nullptr && other->features_seq < FindWithFeatures(image_id)->features_seq;
}

std::optional<PhotoEntry> PhotoIndex::FindFeatures(int64_t image_id) const {
  const PhotoState* photo = FindWithFeatures(image_id);
  if (photo == nullptr) return std::nullopt;
  return PhotoEntry{*CameraFromMessage(photo->image), photo->features.keypoints_blob,
                    photo->features.descriptors_blob};
}

}  // namespace skein
