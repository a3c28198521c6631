#include "mapper/messages.h"

#include <gtest/gtest.h>

#include <cmath>

#include "ledger/fact_ids.h"
#include "ledger/facts.h"
#include "session/merge_similarity.h"
#include "transport/bus.h"

namespace skein::messages_test {

PhotoEvent SomeEvent() {
  PhotoEvent event;
  event.image_id = 42;
  event.state = PhotoEvent::State::kRegistered;
  event.num_visible = 300;
  event.num_inliers = 200;
  event.qvec = {2, 0, 0, 2};
  event.tvec = {1, -2, 3};
  event.mean_error_px = 0.5;
  event.num_ba_images = 12;
  event.register_s = 0.125;
  event.triangulate_s = 0.25;
  event.ba_s = 0.5;
  event.total_s = 1;
  return event;
}

registration_t SentAndReceived(const PhotoEvent& event) {
  registration_t sent = ToMessage(event, 3, 5);
  sent.header.fact_id = RegistrationFactId(event.image_id, 3, 5, 2);
  const Bytes bytes = EncodeFact(sent);
  const auto fact = DecodeFact(FactKindFromName("registration"), bytes.data(), bytes.size());
  EXPECT_TRUE(fact.ok()) << fact.error();
  return std::get<registration_t>(*fact);
}

TEST(MapperMessages, RegistrationRoundTrip) {
  const registration_t got = SentAndReceived(SomeEvent());
  EXPECT_EQ(got.header.fact_id, "registration/42/3/5/2");
  EXPECT_EQ(got.image_id, 42);
  EXPECT_EQ(got.submap_id, 3);
  EXPECT_EQ(got.epoch, 5);
  EXPECT_EQ(got.state, +registration_t::REGISTERED);
  EXPECT_EQ(got.num_visible, 300);
  EXPECT_EQ(got.num_inliers, 200);
  const double half = std::sqrt(0.5);
  EXPECT_NEAR(got.cam_from_world_qwxyz[0], half, 1e-12) << "a unit quaternion, w first";
  EXPECT_EQ(got.cam_from_world_qwxyz[1], 0);
  EXPECT_NEAR(got.cam_from_world_qwxyz[3], half, 1e-12);
  EXPECT_EQ(got.cam_from_world_xyz[1], -2);
  EXPECT_EQ(got.mean_reprojection_error_px, 0.5F);
  EXPECT_EQ(got.num_ba_images, 12);
  EXPECT_EQ(got.register_s, 0.125F);
  EXPECT_EQ(got.triangulate_s, 0.25F);
  EXPECT_EQ(got.local_ba_s, 0.5F);
  EXPECT_EQ(got.total_s, 1);
}

TEST(MapperMessages, TellsEachStateApartWithItsReason) {
  const std::pair<PhotoEvent::State, int8_t> states[] = {
      {PhotoEvent::State::kRegistered, registration_t::REGISTERED},
      {PhotoEvent::State::kDeferred, registration_t::DEFERRED},
      {PhotoEvent::State::kRejected, registration_t::REJECTED},
      {PhotoEvent::State::kWithdrawn, registration_t::WITHDRAWN}};
  for (const auto& [state, expected] : states) {
    PhotoEvent event = SomeEvent();
    event.state = state;
    event.refusal = {Refusal::Cause::kTooFewCommonPoints, "12 inliers"};
    EXPECT_EQ(SentAndReceived(event).state, expected);
    EXPECT_EQ(SentAndReceived(event).reason, "12 inliers");
    EXPECT_EQ(SentAndReceived(event).cause, +registration_t::FEW_COMMON_POINTS);
  }
}

TEST(MapperMessages, SubmapTellsItsSizes) {
  SubmapStatistics statistics;
  statistics.num_images = 11;
  statistics.num_deferred = 2;
  statistics.num_points = 5000;
  statistics.mean_reprojection_error_px = 0.5;
  statistics.mean_track_length = 4.5;
  submap_model_t message{};
  SetFigures(statistics, &message);
  EXPECT_EQ(message.num_images, 11);
  EXPECT_EQ(message.num_deferred, 2);
  EXPECT_EQ(message.num_points, 5000);
  EXPECT_EQ(message.mean_reprojection_error_px, 0.5);
  EXPECT_EQ(message.mean_track_length, 4.5);
}

TEST(MapperMessages, ModelTellsItsCheck) {
  ModelCheck check;
  check.shape = {0.02, 7, 8, 3};
  check.matches = {2200, 214, 5, 6, 83};
  const model_check_t message = ToMessage(check);
  EXPECT_EQ(message.position_sigma, 0.02);
  EXPECT_EQ(message.loose_image, 7);
  EXPECT_EQ(message.anchor_image, 8);
  EXPECT_EQ(message.num_loose_images, 3);
  EXPECT_EQ(message.num_matches, 2200);
  EXPECT_EQ(message.num_contradicting_matches, 214);
  EXPECT_EQ(message.contradicting_image1, 5);
  EXPECT_EQ(message.contradicting_image2, 6);
  EXPECT_EQ(message.num_contradicting_of_pair, 83);
}

// A model whose position on the earth has one outlier for each photo.
ModelAssessment WithOutliers(size_t num_photos) {
  ModelAssessment assessment;
  GeoreferenceSummary& summary = assessment.georeference;
  summary.ok = true;
  summary.num_positions = num_photos + 9;
  summary.num_altitudes = 8;
  summary.num_inliers = 9;
  summary.origin = {48.1, 11.5, 400};
  summary.enu_from_model.scale = 7.5;
  summary.enu_from_model.rotation = Eigen::Quaterniond(0.5, -0.5, 0.5, 0.5);
  summary.enu_from_model.translation = {1, 2, 3};
  summary.rmse_m = 2;
  summary.horizontal_rmse_m = 1.5;
  for (size_t i = 1; i <= num_photos; ++i) {
    const std::string name = "alice/" + std::to_string(i);
    assessment.image_of[name] = static_cast<int64_t>(i);
    summary.outliers.push_back({name, 0.5 * static_cast<double>(i)});
  }
  return assessment;
}

TEST(MapperMessages, ModelTellsWhereItLies) {
  const georeference_t message = GeoreferenceOf(WithOutliers(2));
  EXPECT_TRUE(message.ok);
  EXPECT_EQ(message.num_positions, 11);
  EXPECT_EQ(message.num_altitudes, 8);
  EXPECT_EQ(message.num_inliers, 9);
  EXPECT_EQ(message.latitude_deg, 48.1);
  EXPECT_TRUE(message.has_altitude);
  EXPECT_EQ(message.altitude_m, 400);
  EXPECT_EQ(message.scale, 7.5);
  EXPECT_EQ(message.rotation_qwxyz[1], -0.5);
  EXPECT_EQ(message.translation_m[2], 3);
  EXPECT_EQ(message.rmse_m, 2);
  EXPECT_EQ(message.horizontal_rmse_m, 1.5);
  EXPECT_FALSE(message.has_vertical_rmse);
  EXPECT_EQ(message.num_outliers, 2);
  EXPECT_EQ(message.outlier_images, (std::vector<int64_t>{1, 2}));
  EXPECT_EQ(message.outlier_residuals_m, (std::vector<double>{0.5, 1}));
}

TEST(MapperMessages, OfManyOutliersTheLargestAreTold) {
  submap_model_t model{};
  model.georeference = GeoreferenceOf(WithOutliers(kMaxToldOutliers + 500));
  EXPECT_EQ(model.georeference.num_outliers, static_cast<int32_t>(kMaxToldOutliers));
  EXPECT_EQ(model.georeference.outlier_images.front(), 1500);
  EXPECT_EQ(model.georeference.outlier_images.back(), 501);
  EXPECT_LT(model.getEncodedSize() + kMaxTrailerBytes, kMaxMessageBytes);
}

TEST(MapperMessages, AModelThatCannotBeLocatedTellsTheReason) {
  ModelAssessment assessment = WithOutliers(2);
  assessment.georeference.ok = false;
  assessment.georeference.reason = "the photos were taken along a line";
  const georeference_t message = GeoreferenceOf(assessment);
  EXPECT_FALSE(message.ok);
  EXPECT_EQ(message.reason, "the photos were taken along a line");
  EXPECT_EQ(message.num_positions, 11);
  EXPECT_EQ(message.num_outliers, 0);
}

TEST(MapperMessages, PhotoIsNamedByItsAgent) {
  image_t image{};
  image.image_id = 7;
  image.camera_id = 2;
  image.agent = "alice";
  image.name = "left/a.jpg";
  image.width_px = 1600;
  image.height_px = 1200;
  image.focal_px = 1300;
  image.focal_from_exif = 1;
  const PhotoInput photo = ToPhotoInput(image, Keypoints(5));
  EXPECT_EQ(photo.image_id, 7);
  EXPECT_EQ(photo.camera_id, 2);
  EXPECT_EQ(photo.name, "alice/left/a.jpg");
  EXPECT_EQ(photo.width_px, 1600);
  EXPECT_EQ(photo.height_px, 1200);
  EXPECT_EQ(photo.focal_px, 1300);
  EXPECT_TRUE(photo.focal_from_exif);
  EXPECT_EQ(photo.keypoints.size(), 5u);
}

TEST(MapperMessages, AMergesOrderHasTheSimilarityAndItsOptions) {
  Sim3Options options;
  options.min_inlier_images = 2;
  options.seed = 7;
  merge_t ordered{};
  ordered.num_shared_images = 2;
  ordered.num_inlier_images = 2;
  SetSimilarity({3, Eigen::Quaterniond::Identity(), {1, 2, 3}}, &ordered);
  SetSim3Options(options, &ordered);
  const MergeOrder order = MergeOrderOf(ordered);
  ASSERT_TRUE(order.target_from_source);
  EXPECT_EQ(order.target_from_source->scale, 3);
  EXPECT_EQ(order.num_agreeing, 2);
  EXPECT_EQ(order.min_shared_images, 2);
  EXPECT_EQ(order.sim3.min_inlier_images, 2);
  EXPECT_EQ(order.sim3.seed, 7u);
}

TEST(MapperMessages, AMergesOrderWithoutUsableValuesHasNoSimilarityAndUsualOptions) {
  merge_t ordered{};
  ordered.num_shared_images = 20;
  const MergeOrder order = MergeOrderOf(ordered);
  EXPECT_FALSE(order.target_from_source);
  EXPECT_TRUE(order.sim3.Check().ok());
  EXPECT_EQ(order.min_shared_images, AbsorbOptions().min_shared_images);
}

}  // namespace skein::messages_test
