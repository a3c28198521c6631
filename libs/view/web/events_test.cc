#include "web/events.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

namespace skein::events_test {

using nlohmann::json;

template <class T>
json EventOfFact(T fact) {
  fact.header.seq = 7;
  fact.header.utime_us = 1'700'000'000'000'000;
  const std::string text = EventOf(Fact(fact));
  return text.empty() ? json() : json::parse(text);
}

TEST(Events, EveryKindOfFactIsAnEventButLeasesAndConfigurations) {
  EXPECT_EQ(EventOfFact(image_t{})["kind"], "photo");
  EXPECT_EQ(EventOfFact(features_t{})["kind"], "described");
  EXPECT_EQ(EventOfFact(candidates_t{})["kind"], "candidates");
  EXPECT_EQ(EventOfFact(matches_t{})["kind"], "matched");
  EXPECT_EQ(EventOfFact(registration_t{})["kind"], "registration");
  EXPECT_EQ(EventOfFact(seed_t{})["kind"], "submap");
  EXPECT_EQ(EventOfFact(submap_model_t{})["kind"], "submap");
  EXPECT_EQ(EventOfFact(submap_end_t{})["kind"], "submap");
  EXPECT_EQ(EventOfFact(merge_t{})["kind"], "merge");
  EXPECT_EQ(EventOfFact(failure_t{})["kind"], "failure");
  EXPECT_EQ(EventOfFact(finish_t{})["kind"], "finish");
  EXPECT_TRUE(EventOfFact(submap_lease_t{}).is_null());
  EXPECT_TRUE(EventOfFact(configuration_t{}).is_null());
}

TEST(Events, EachTellsItsPlaceInTheLedger) {
  const json event = EventOfFact(finish_t{});
  EXPECT_EQ(event["seq"], 7);
  EXPECT_EQ(event["t"], 1'700'000'000'000'000);
}

TEST(Events, AFinishTellsItsDeadlineWhereItIsSet) {
  finish_t finish{};
  finish.deadline_utime_us = 1'700'000'060'000'000;
  for (const int8_t state : {finish_t::REQUESTED, finish_t::DEADLINE}) {
    finish.state = state;
    EXPECT_EQ(EventOfFact(finish)["deadline"], 1'700'000'060'000'000);
  }
  finish.state = finish_t::DONE;
  EXPECT_FALSE(EventOfFact(finish).contains("deadline"));
}

TEST(Events, APhotoTellsItsSizeAndWhereItWasTaken) {
  image_t image{};
  image.image_id = 3;
  image.camera_id = 2;
  image.agent = "alice";
  image.name = "a.jpg";
  image.width_px = 640;
  image.height_px = 480;
  image.orientation = 6;
  image.size_bytes = 12345;
  image.focal_px = 512.3456;
  image.capture_utime_us = 5;
  image.received_utime_us = 6;
  EXPECT_FALSE(EventOfFact(image).contains("gps"));
  image.has_gps = true;
  image.latitude_deg = 48.123456789;
  image.longitude_deg = -11.5;
  EXPECT_EQ(EventOfFact(image)["gps"], (json{48.12345679, -11.5}));
  image.has_altitude = true;
  image.altitude_m = 501.25;
  const json event = EventOfFact(image);
  EXPECT_EQ(event["image"], 3);
  EXPECT_EQ(event["camera"], 2);
  EXPECT_EQ(event["agent"], "alice");
  EXPECT_EQ(event["name"], "a.jpg");
  EXPECT_EQ(event["width"], 640);
  EXPECT_EQ(event["height"], 480);
  EXPECT_EQ(event["orientation"], 6);
  EXPECT_EQ(event["bytes"], 12345);
  EXPECT_EQ(event["captured"], 5);
  EXPECT_EQ(event["received"], 6);
  EXPECT_EQ(event["gps"], (json{48.12345679, -11.5, 501.25}));
}

TEST(Events, MatchesTellTheirVerifiedPairs) {
  matches_t matches{};
  matches.image_id = 5;
  matches.num_pairs = 2;
  matches.pairs.resize(2);
  matches.pairs[0].other_id = 1;
  matches.pairs[0].num_inliers = 100;
  matches.pairs[1].other_id = 4;
  matches.pairs[1].num_inliers = 30;
  matches.match_s = 0.25;
  matches.verify_s = 0.5;
  const json event = EventOfFact(matches);
  EXPECT_EQ(event["pairs"], (json{{1, 100}, {4, 30}}));
  EXPECT_EQ(event["s"], 0.75);
}

TEST(Events, APoseIsToldOfRegisteredPhotosAlone) {
  registration_t fact{};
  fact.image_id = 5;
  fact.submap_id = 2;
  fact.state = registration_t::REGISTERED;
  fact.cam_from_world_qwxyz[0] = 1;
  fact.cam_from_world_xyz[2] = 1.0 / 3;
  fact.num_inliers = 40;
  fact.num_visible = 50;
  fact.total_s = 0.125;
  json event = EventOfFact(fact);
  EXPECT_EQ(event["state"], "registered");
  EXPECT_EQ(event["pose"], (json{1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.3333333}));
  EXPECT_EQ(event["inliers"], 40);
  EXPECT_EQ(event["visible"], 50);
  fact.state = registration_t::WITHDRAWN;
  fact.reason = "no longer";
  event = EventOfFact(fact);
  EXPECT_EQ(event["state"], "withdrawn");
  EXPECT_EQ(event["reason"], "no longer");
  EXPECT_FALSE(event.contains("pose"));
}

TEST(Events, ASubmapsLife) {
  seed_t seed{};
  seed.submap_id = 2;
  EXPECT_EQ(EventOfFact(seed)["state"], "seeded");
  submap_model_t model{};
  model.submap_id = 2;
  model.kind = submap_model_t::CHECKPOINT;
  model.num_images = 10;
  model.num_points = 1000;
  json event = EventOfFact(model);
  EXPECT_EQ(event["state"], "checkpoint");
  EXPECT_EQ(event["photos"], 10);
  EXPECT_FALSE(event.contains("expected_error_percent")) << "it is not known";
  model.kind = submap_model_t::FINAL;
  model.check.position_sigma = 0.0025;
  event = EventOfFact(model);
  EXPECT_EQ(event["state"], "final");
  EXPECT_EQ(event["expected_error_percent"], 0.25);
  submap_end_t end{};
  end.submap_id = 2;
  end.merged_into = 1;
  event = EventOfFact(end);
  EXPECT_EQ(event["state"], "ended");
  EXPECT_EQ(event["merged_into"], 1);
}

TEST(Events, AMergeTellsItsSimilarity) {
  merge_t merge{};
  merge.merge_id = 9;
  merge.state = merge_t::FAILED;
  EXPECT_FALSE(EventOfFact(merge).contains("similarity"));
  merge.state = merge_t::ORDERED;
  merge.source_id = 2;
  merge.target_id = 1;
  merge.target_from_source_scale = 2;
  merge.target_from_source_qwxyz[0] = 1;
  merge.target_from_source_xyz[0] = 3;
  const json event = EventOfFact(merge);
  EXPECT_EQ(event["state"], "ordered");
  EXPECT_EQ(event["merge"], 9);
  EXPECT_EQ(event["similarity"], (json{2.0, 1.0, 0.0, 0.0, 0.0, 3.0, 0.0, 0.0}));
}

TEST(Events, NumbersThatAreNoneBecomeZero) {
  registration_t fact{};
  fact.state = registration_t::REGISTERED;
  fact.cam_from_world_xyz[0] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(EventOfFact(fact)["pose"][4], 0.0);
}

TEST(Events, RefusalsTellTheirCause) {
  registration_t deferred{};
  deferred.state = registration_t::DEFERRED;
  deferred.cause = registration_t::FEW_COMMON_POINTS;
  EXPECT_EQ(EventOfFact(deferred)["cause"], "weak overlap");
  deferred.cause = registration_t::OTHER;
  EXPECT_EQ(EventOfFact(deferred)["cause"], "other");
  failure_t failure{};
  EXPECT_EQ(EventOfFact(failure)["cause"], "failed");
  failure.cause = failure_t::PHONE_FORMAT;
  EXPECT_EQ(EventOfFact(failure)["cause"], "phone format");
}

TEST(Events, TextsCannotBreakTheJson) {
  failure_t failure{};
  failure.reason = "\"}\n\x01 <script>";
  EXPECT_EQ(EventOfFact(failure)["reason"], failure.reason);
}

}  // namespace skein::events_test
