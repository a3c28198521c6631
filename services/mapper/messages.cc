#include "mapper/messages.h"

#include <cmath>

#include "sfm/pose.h"

namespace skein {

PhotoInput ToPhotoInput(const image_t& image, Keypoints keypoints) {
  PhotoInput photo;
  photo.image_id = image.image_id;
  photo.camera_id = image.camera_id;
  photo.name = image.agent + "/" + image.name;
  photo.width_px = image.width_px;
  photo.height_px = image.height_px;
  photo.focal_px = image.focal_px;
  photo.focal_from_exif = image.focal_from_exif;
  photo.camera_model = image.camera_model;
  photo.camera_params = image.camera_params;
  photo.camera_fixed = image.camera_fixed;
  photo.keypoints = std::move(keypoints);
  return photo;
}

std::vector<std::pair<uint32_t, double>> ToDistances(const candidates_t& candidates) {
  std::vector<std::pair<uint32_t, double>> distances;
  for (int i = 0; i < candidates.num_candidates; ++i) {
    const int64_t id = candidates.other_ids[i];
    const double distance = candidates.distances[i];
    if (id < 1 || id > INT32_MAX || !std::isfinite(distance) || distance < 0) continue;
    distances.emplace_back(static_cast<uint32_t>(id), distance);
  }
  return distances;
}

registration_t ToMessage(const PhotoEvent& event, int64_t submap_id, int64_t epoch) {
  registration_t message{};
  message.image_id = event.image_id;
  message.submap_id = submap_id;
  message.epoch = epoch;
  switch (event.state) {
    case PhotoEvent::State::kRegistered:
      message.state = registration_t::REGISTERED;
      break;
    case PhotoEvent::State::kDeferred:
      message.state = registration_t::DEFERRED;
      break;
    case PhotoEvent::State::kRejected:
      message.state = registration_t::REJECTED;
      break;
    case PhotoEvent::State::kWithdrawn:
      message.state = registration_t::WITHDRAWN;
      break;
  }
  message.cause = static_cast<int8_t>(event.refusal.cause);
  message.reason = event.refusal.text;
  message.num_visible = event.num_visible;
  message.num_inliers = event.num_inliers;
  const Eigen::Vector4d qvec = NormalizeQuaternion(event.qvec);
  for (int i = 0; i < 4; ++i) message.cam_from_world_qwxyz[i] = qvec[i];
  for (int i = 0; i < 3; ++i) message.cam_from_world_xyz[i] = event.tvec[i];
  message.mean_reprojection_error_px = static_cast<float>(event.mean_error_px);
  message.num_ba_images = event.num_ba_images;
  message.register_s = static_cast<float>(event.register_s);
  message.triangulate_s = static_cast<float>(event.triangulate_s);
  message.local_ba_s = static_cast<float>(event.ba_s);
  message.total_s = static_cast<float>(event.total_s);
  return message;
}

model_check_t ToMessage(const ModelCheck& check) {
  model_check_t message{};
  message.position_sigma = check.shape.position_sigma;
  message.loose_image = check.shape.loose_image;
  message.anchor_image = check.shape.anchor_image;
  message.num_loose_images = check.shape.num_loose_images;
  message.num_pairs = check.pairs.num_pairs;
  message.num_contradicting_pairs = check.pairs.num_contradicting;
  message.contradicting_image1 = check.pairs.strongest1;
  message.contradicting_image2 = check.pairs.strongest2;
  message.num_contradicting_matches = check.pairs.num_contradicting_matches;
  return message;
}

}  // namespace skein
