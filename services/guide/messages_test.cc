#include "guide/messages.h"

#include <gtest/gtest.h>

#include <limits>
#include <vector>

#include "session/guidance_json.h"
#include "transport/bus.h"
#include "transport/decode.h"

namespace skein::messages_test {

template <class T>
T RoundTrip(const T& message) {
  std::vector<uint8_t> bytes(message.getEncodedSize());
  message.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
  T read{};
  EXPECT_TRUE(DecodeMessage(bytes.data(), bytes.size(), &read));
  return read;
}

AdvisedStation MakeStation(const std::string& sentence) {
  AdvisedStation advised;
  advised.station.cam_from_world.rotation = Eigen::Quaterniond(0.5, 0.5, -0.5, 0.5);
  advised.station.cam_from_world.translation = {1.5, -2, 3};
  advised.station.target = {4, 5, 6};
  advised.station.gain = 0.75;
  advised.station.common_points = 230;
  advised.station.why = Station::Why::kTooSlanted;
  advised.nearest_image_id = 31;
  advised.offset = {-2.25, 0.5, 1};
  advised.sentence = sentence;
  return advised;
}

PlaceGuidance MakeGuidance() {
  PlaceGuidance guidance;
  guidance.submap_id = 3;
  guidance.version = 1'700'000'000'000'000;
  guidance.place.num_photos = 40;
  guidance.place.num_surfels = 800;
  guidance.place.num_open = 12;
  guidance.place.completeness.area = 55.5;
  guidance.place.completeness.good_share = 0.75;
  guidance.place.completeness.open_share = 0.125;
  guidance.place.completeness.median_sigma = std::numeric_limits<double>::infinity();
  guidance.place.completeness.target_gsd = 0.01;
  guidance.working_distance = 5;
  guidance.metres_per_unit = 2.5;
  guidance.place.verdict = PlaceVerdict::kWeak;
  guidance.place.sentence = "75 % of the surface is good, 12 open borders: keep going";
  return guidance;
}

TEST(GuideMessages, GuidanceRoundTrips) {
  const guidance_t read = RoundTrip(ToMessage(MakeGuidance()));
  EXPECT_EQ(read.submap_id, 3);
  EXPECT_EQ(read.version, 1'700'000'000'000'000);
  EXPECT_EQ(read.place.num_photos, 40);
  EXPECT_EQ(read.place.num_surfels, 800);
  EXPECT_EQ(read.place.num_open, 12);
  EXPECT_EQ(read.place.area, 55.5);
  EXPECT_EQ(read.place.good_share, 0.75F);
  EXPECT_EQ(read.place.open_share, 0.125F);
  EXPECT_EQ(read.place.median_sigma, 0) << "not known";
  EXPECT_EQ(read.place.target_gsd, 0.01);
  EXPECT_EQ(read.place.metres_per_unit, 2.5);
  EXPECT_EQ(read.place.verdict, +completeness_t::WEAK);
  EXPECT_EQ(read.place.sentence, MakeGuidance().place.sentence);
  EXPECT_EQ(GuidanceJson(read)["verdict"], "weak");
}

TEST(GuideMessages, AReportTellsThePlacesAgain) {
  const guidance_t guidance = ToMessage(MakeGuidance());
  nlohmann::json report = {{"submaps",
                            {{{"id", 3}, {"completeness", PlaceJson(guidance.place)}},
                             {{"id", 4}, {"completeness", {{"reason", "no model"}}}},
                             {{"id", "5"}},
                             7}}};
  const auto places = PlacesOfReport(report);
  ASSERT_EQ(places.size(), 1u);
  nlohmann::json expected = GuidanceJson(guidance);
  expected["version"] = 0;
  EXPECT_EQ(GuidanceJson(places.at(3)), expected);
  report["submaps"][0]["completeness"] = {{"verdict", 3}, {"photos", "many"}};
  EXPECT_EQ(PlacesOfReport(report).at(3).place.num_photos, 0);
  EXPECT_TRUE(PlacesOfReport(nullptr).empty());
  EXPECT_TRUE(PlacesOfReport({{"submaps", nullptr}}).empty());
}

TEST(GuideMessages, AdviceRoundTrips) {
  AgentAdvice advice{"alice", 39, {MakeStation("to the left"), MakeStation("to the right")}};
  const advice_t read = RoundTrip(ToMessage(MakeGuidance(), advice));
  EXPECT_EQ(read.agent, "alice");
  EXPECT_EQ(read.submap_id, 3);
  EXPECT_EQ(read.last_image_id, 39);
  EXPECT_EQ(read.working_distance, 5);
  EXPECT_EQ(read.metres_per_unit, 2.5);
  ASSERT_EQ(read.num_stations, 2);
  const station_t& station = read.stations[0];
  EXPECT_EQ(station.cam_from_world_qwxyz[2], -0.5F);
  EXPECT_EQ(station.cam_from_world_xyz[1], -2.F);
  EXPECT_EQ(station.target[2], 6.F);
  EXPECT_EQ(station.gain, 0.75F);
  EXPECT_EQ(station.common_points, 230.F);
  EXPECT_EQ(station.why, +station_t::TOO_SLANTED);
  EXPECT_EQ(station.nearest_image_id, 31);
  EXPECT_EQ(station.right, -2.25F);
  EXPECT_EQ(station.down, 0.5F);
  EXPECT_EQ(station.forward, 1.F);
  EXPECT_EQ(station.sentence, "to the left");
  EXPECT_EQ(read.stations[1].sentence, "to the right");
  EXPECT_EQ(AdviceJson(read)["stations"][0]["why"], "too_slanted");
}

TEST(GuideMessages, ConstantsOfTheMessagesAreThoseOfTheCode) {
  EXPECT_EQ(static_cast<int>(Station::Why::kFewPhotos), +station_t::FEW_PHOTOS);
  EXPECT_EQ(static_cast<int>(Station::Why::kNoParallax), +station_t::NO_PARALLAX);
  EXPECT_EQ(static_cast<int>(Station::Why::kTooSlanted), +station_t::TOO_SLANTED);
  EXPECT_EQ(static_cast<int>(Station::Why::kTooFar), +station_t::TOO_FAR);
  EXPECT_EQ(static_cast<int>(Station::Why::kOpenBorder), +station_t::OPEN_BORDER);
  EXPECT_EQ(static_cast<int>(PlaceVerdict::kGrowing), +completeness_t::GROWING);
  EXPECT_EQ(static_cast<int>(PlaceVerdict::kNearly), +completeness_t::NEARLY);
  EXPECT_EQ(static_cast<int>(PlaceVerdict::kComplete), +completeness_t::COMPLETE);
}

TEST(GuideMessages, AnAdviceFitsOneFrameWithTheBestStations) {
  AgentAdvice advice{std::string(64, 'a'), 39, {}};
  for (int i = 0; i < 5; ++i) advice.stations.push_back(MakeStation(std::string(100, 'x')));
  advice_t message = ToMessage(MakeGuidance(), advice);
  EXPECT_EQ(message.num_stations, 5) << "sentences of the usual length";
  advice.stations.clear();
  for (int i = 0; i < 5; ++i) advice.stations.push_back(MakeStation(std::string(1000, '1' + i)));
  message = ToMessage(MakeGuidance(), advice);
  message.session_id = std::string(16, 'a');
  message.author = std::string(64, 'a');
  EXPECT_GE(message.num_stations, 2);
  EXPECT_EQ(message.stations[0].sentence[0], '1');
  EXPECT_LE(message.getEncodedSize() + kMaxTrailerBytes, kMaxDatagramBytes);
  RoundTrip(message);
}

TEST(GuideMessages, JsonTakesWhatItDoesNotKnow) {
  advice_t advice{};
  advice.num_stations = 1;
  advice.stations.resize(1);
  advice.stations[0].why = 77;
  EXPECT_EQ(AdviceJson(advice)["stations"][0]["why"], "unknown");
  guidance_t guidance{};
  guidance.place.verdict = -5;
  EXPECT_EQ(GuidanceJson(guidance)["verdict"], "growing");
}

}  // namespace skein::messages_test
