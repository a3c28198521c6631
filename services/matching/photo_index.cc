#include "matching/photo_index.h"

#include <unordered_set>

#include "matching/messages.h"

namespace skein {

Status PhotoIndex::Take(const Fact& fact) {
  if (const auto* image = std::get_if<image_t>(&fact)) return TakeImage(*image);
  if (const auto* features = std::get_if<features_t>(&fact)) return TakeFeatures(*features);
  if (const auto* candidates = std::get_if<candidates_t>(&fact)) return TakeCandidates(*candidates);
  if (const auto* matches = std::get_if<matches_t>(&fact)) return TakeMatches(*matches);
  return Status::Ok();
}

Status PhotoIndex::TakeImage(const image_t& image) {
  Result<colmap::Camera> camera = CameraFromMessage(image);
  if (!camera.ok()) return camera.status();
  photos_[image.image_id].camera = std::move(*camera);
  return Status::Ok();
}

Status PhotoIndex::TakeFeatures(const features_t& features) {
  const auto photo = photos_.find(features.image_id);
  if (photo == photos_.end()) {
    return NotFound("features of unknown image " + std::to_string(features.image_id));
  }
  photo->second.keypoints_blob = features.keypoints_blob;
  photo->second.descriptors_blob = features.descriptors_blob;
  photo->second.features_seq = features.header.seq;
  return Status::Ok();
}

Status PhotoIndex::TakeCandidates(const candidates_t& candidates) {
  std::vector<int64_t>& others = candidates_[candidates.image_id];
  others.clear();
  std::unordered_set<int64_t> seen{candidates.image_id};
  for (const int64_t other_id : candidates.other_ids) {
    if (FindFeatures(other_id) && seen.insert(other_id).second) others.push_back(other_id);
  }
  if (others.size() == candidates.other_ids.size()) return Status::Ok();
  return InvalidArgument("candidates of image " + std::to_string(candidates.image_id) + ": " +
                         std::to_string(candidates.other_ids.size() - others.size()) +
                         " are left out as doubled or without features");
}

Status PhotoIndex::TakeMatches(const matches_t& matches) {
  for (const two_view_t& pair : matches.pairs) {
    if (pair.num_inliers < 1 || pair.other_id == matches.image_id) {
      return InvalidArgument("matches of image " + std::to_string(matches.image_id) +
                             " hold a pair that cannot be");
    }
    covisibility_.Add(matches.image_id, pair.other_id, pair.num_inliers, matches.header.seq);
  }
  return Status::Ok();
}

bool PhotoIndex::IsEarlier(int64_t other_id, int64_t image_id) const {
  const PhotoEntry* other = FindFeatures(other_id);
  return other && other->features_seq < FindFeatures(image_id)->features_seq;
}

const PhotoEntry* PhotoIndex::FindFeatures(int64_t image_id) const {
  const auto photo = photos_.find(image_id);
  if (photo == photos_.end() || photo->second.descriptors_blob.empty()) return nullptr;
  return &photo->second;
}

}  // namespace skein
