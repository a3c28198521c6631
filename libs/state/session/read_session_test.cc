#include "session/read_session.h"

#include <gtest/gtest.h>

namespace skein::read_session_test {

class PositionsTest : public testing::Test {
 protected:
  image_t Photo(const std::string& agent) {
    image_t image{};
    image.header.seq = ++last_;
    image.image_id = last_;
    image.agent = agent;
    image.name = std::to_string(last_) + ".jpg";
    image.has_gps = true;
    image.latitude_deg = 48;
    image.longitude_deg = 11;
    return image;
  }
  void Add(const std::string& agent, std::optional<double> altitude_m,
           std::optional<double> relative_altitude_m) {
    image_t image = Photo(agent);
    image.has_altitude = altitude_m.has_value();
    image.altitude_m = altitude_m.value_or(0);
    image.has_relative_altitude = relative_altitude_m.has_value();
    image.relative_altitude_m = relative_altitude_m.value_or(0);
    state_.Apply(Fact(image));
  }

  SessionState state_;
  int64_t last_ = 0;
};

TEST_F(PositionsTest, APhotoWithoutPositionHasNone) {
  image_t image = Photo("alice");
  image.has_gps = false;
  state_.Apply(Fact(image));
  EXPECT_TRUE(PositionsOf(state_).empty());
  EXPECT_FALSE(PositionOf(image));
}

TEST_F(PositionsTest, AnUnknownAltitudeIsNotZero) {
  Add("alice", 341.5, {});
  Add("alice", {}, {});
  Add("alice", 0, {});
  const auto positions = PositionsOf(state_);
  EXPECT_EQ(positions.at("alice/1.jpg").altitude_m, 341.5);
  EXPECT_FALSE(positions.at("alice/2.jpg").altitude_m);
  EXPECT_EQ(positions.at("alice/3.jpg").altitude_m, 0.0) << "the sea's";
}

TEST_F(PositionsTest, HeightsAboveTheTakeOffNeedItsAltitude) {
  Add("drone", 570, 70);  // took off at 500 m
  Add("drone", 565, 64);
  Add("drone", 9000, 60);
  Add("drone", {}, 80);
  Add("drone", {}, {});
  Add("other", {}, 30);
  const auto positions = PositionsOf(state_);
  EXPECT_EQ(positions.at("drone/1.jpg").altitude_m, 570.0) << "its own";
  EXPECT_EQ(positions.at("drone/4.jpg").altitude_m, 581.0)
      << "501 m is the median of the take-offs";
  EXPECT_FALSE(positions.at("drone/5.jpg").altitude_m);
  EXPECT_FALSE(positions.at("other/6.jpg").altitude_m) << "another drone took off elsewhere";
}

TEST_F(PositionsTest, PhotosThatCameLaterDoNotCount) {
  Add("drone", 570, 70);
  Add("drone", {}, 80);
  Add("drone", 9000, 60);
  const auto positions = PositionsOf(state_, 2);
  EXPECT_EQ(positions.size(), 2u);
  EXPECT_EQ(positions.at("drone/2.jpg").altitude_m, 580.0);
}

}  // namespace skein::read_session_test
