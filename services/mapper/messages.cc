#include "mapper/messages.h"

#include <algorithm>
#include <iterator>

#include "ledger/facts.h"
#include "session/merge_similarity.h"
#include "sfm/pose.h"

namespace skein {
namespace {

void SetFrame(const GeoreferenceSummary& summary, georeference_t* message) {
  message->latitude_deg = summary.origin.latitude_deg;
  message->longitude_deg = summary.origin.longitude_deg;
  message->has_altitude = summary.origin.altitude_m ? 1 : 0;
  message->altitude_m = summary.origin.altitude_m.value_or(0);
  const Similarity& enu_from_model = summary.enu_from_model;
  message->scale = enu_from_model.scale;
  const Eigen::Quaterniond& q = enu_from_model.rotation;
  const double qwxyz[] = {q.w(), q.x(), q.y(), q.z()};
  std::copy(std::begin(qwxyz), std::end(qwxyz), message->rotation_qwxyz);
  for (int i = 0; i < 3; ++i) message->translation_m[i] = enu_from_model.translation[i];
}

void SetAccuracy(const GeoreferenceSummary& summary, georeference_t* message) {
  message->num_inliers = static_cast<int32_t>(summary.num_inliers);
  message->altitudes_used = summary.altitudes_used ? 1 : 0;
  message->rotation_sigma_deg = summary.rotation_sigma_deg;
  message->scale_sigma = summary.scale_sigma;
  message->rmse_m = summary.rmse_m;
  message->median_m = summary.median_m;
  message->max_m = summary.max_m;
  message->horizontal_rmse_m = summary.horizontal_rmse_m;
  message->has_vertical_rmse = summary.vertical_rmse_m ? 1 : 0;
  message->vertical_rmse_m = summary.vertical_rmse_m.value_or(0);
}

void SetOutliers(const ModelAssessment& assessment, georeference_t* message) {
  std::vector<GeoOutlier> outliers = assessment.georeference.outliers;
  if (outliers.size() > kMaxToldOutliers) {
    std::stable_sort(outliers.begin(), outliers.end(),
                     [](const auto& a, const auto& b) { return a.residual_m > b.residual_m; });
    outliers.resize(kMaxToldOutliers);
  }
  for (const GeoOutlier& outlier : outliers) {
    message->outlier_images.push_back(assessment.image_of.at(outlier.name));
    message->outlier_residuals_m.push_back(outlier.residual_m);
  }
  message->num_outliers = static_cast<int32_t>(outliers.size());
}

}  // namespace

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

MergeOrder MergeOrderOf(const merge_t& ordered) {
  MergeOrder order;
  order.target_from_source = SimilarityOf(ordered);
  order.num_agreeing = ordered.num_inlier_images;
  order.min_shared_images = std::min(order.min_shared_images, ordered.num_shared_images);
  const Sim3Options sim3 = Sim3OptionsOf(ordered);
  if (sim3.Check().ok()) order.sim3 = sim3;
  return order;
}

model_check_t ToMessage(const ModelCheck& check) {
  model_check_t message{};
  message.position_sigma = check.shape.position_sigma;
  message.loose_image = check.shape.loose_image;
  message.anchor_image = check.shape.anchor_image;
  message.num_loose_images = check.shape.num_loose_images;
  message.num_matches = check.matches.num_matches;
  message.num_contradicting_matches = check.matches.num_contradicting;
  message.contradicting_image1 = check.matches.strongest1;
  message.contradicting_image2 = check.matches.strongest2;
  message.num_contradicting_of_pair = check.matches.num_of_strongest;
  return message;
}

georeference_t GeoreferenceOf(const ModelAssessment& assessment) {
  const GeoreferenceSummary& summary = assessment.georeference;
  georeference_t message{};
  message.ok = summary.ok ? 1 : 0;
  message.reason = ClampText(summary.reason);
  message.num_positions = static_cast<int32_t>(summary.num_positions);
  message.num_altitudes = static_cast<int32_t>(summary.num_altitudes);
  if (!summary.ok) return message;
  SetFrame(summary, &message);
  SetAccuracy(summary, &message);
  SetOutliers(assessment, &message);
  return message;
}

}  // namespace skein
