#include "guide/place_guidance.h"

#include <gtest/gtest.h>

#include "testing/test_place.h"

namespace skein::place_guidance_test {

Result<PlaceGuidance> FirstGuidance(const PlaceInput& input) {
  const GuideOptions options;
  const NoGoAreas no_go;
  return PlaceGuide(options, no_go).Update(input);
}

PlaceGuidance Guide(const TestPlace& place, const GuideOptions& options = {},
                    const NoGoAreas& no_go = {}) {
  Result<PlaceGuidance> guidance = PlaceGuide(options, no_go).Update(place.Input());
  EXPECT_TRUE(guidance.ok()) << guidance.error();
  return *guidance;
}

Eigen::Vector3d CentreOf(const AdvisedStation& advised) {
  return advised.station.cam_from_world.Centre();
}

// alice on the left, bob on the right of the wall.
TestPlace TwoWalks() {
  TestPlace place(20, 4, 6000);
  place.Walk("alice", 4, 8, 6);
  place.Walk("bob", 9, 13, 6);
  return place;
}

TEST(PlaceGuidance, AdvisesEachAgentSomethingElse) {
  const TestPlace place = TwoWalks();
  const PlaceGuidance guidance = Guide(place);
  EXPECT_EQ(guidance.submap_id, 3);
  EXPECT_EQ(guidance.version, 10u);
  EXPECT_EQ(guidance.place.num_photos, 12u);
  EXPECT_GT(guidance.place.num_surfels, 50u);
  EXPECT_EQ(guidance.metres_per_unit, 0);
  ASSERT_EQ(guidance.advice.size(), 2u);
  EXPECT_EQ(guidance.advice[0].agent, "alice");
  EXPECT_EQ(guidance.advice[0].last_image_id, 6);
  EXPECT_EQ(guidance.advice[1].agent, "bob");
  EXPECT_EQ(guidance.advice[1].last_image_id, 12);
  ASSERT_FALSE(guidance.advice[0].stations.empty());
  ASSERT_FALSE(guidance.advice[1].stations.empty());
  for (const AdvisedStation& alices : guidance.advice[0].stations) {
    for (const AdvisedStation& bobs : guidance.advice[1].stations) {
      EXPECT_GT((CentreOf(alices) - CentreOf(bobs)).norm(), 0.1);
    }
  }
}

TEST(PlaceGuidance, WhatThePhotosShowNoTextureOnIsNotGood) {
  const TestPlace place = TwoWalks();
  PlaceInput input = place.Input();
  const double good = Guide(place).place.completeness.good_share;
  EXPECT_GT(good, 0.2);
  for (auto& [id, photo] : input.photos) {
    photo.texture.emplace();
    photo.texture->bits.fill(0xff);
  }
  EXPECT_EQ(FirstGuidance(input)->place.completeness.good_share, good);
  for (auto& [id, photo] : input.photos) photo.texture.emplace();
  EXPECT_EQ(FirstGuidance(input)->place.completeness.good_share, 0);
}

TEST(PlaceGuidance, AStationIsToldFromThePhotoNearest) {
  const TestPlace place = TwoWalks();
  for (const AgentAdvice& advice : Guide(place).advice) {
    for (const AdvisedStation& advised : advice.stations) {
      ASSERT_EQ(place.photos().count(advised.nearest_image_id), 1u);
      const CameraPose near = TestPlace::PoseOf(place.poses()[advised.nearest_image_id - 1]);
      const Eigen::Vector3d back =
          near.Centre() + near.rotation.conjugate() * advised.offset - CentreOf(advised);
      EXPECT_LT(back.norm(), 1e-9);
      const GuidePhoto& photo = place.photos().at(advised.nearest_image_id);
      EXPECT_NE(advised.sentence.find(photo.agent + "/" + photo.name), std::string::npos)
          << advised.sentence;
    }
  }
}

TEST(PlaceGuidance, OnlyAgentsThatAskAreAdvised) {
  PlaceInput input = TwoWalks().Input();
  input.agents = {"bob", "carol"};
  const Result<PlaceGuidance> guidance = FirstGuidance(input);
  ASSERT_TRUE(guidance.ok());
  ASSERT_EQ(guidance->advice.size(), 1u);
  EXPECT_EQ(guidance->advice[0].agent, "bob");
}

// Photos from two distances and heights: their positions fix the model on the earth.
TestPlace Located(double metres) {
  TestPlace place(20, 8, 9000);
  for (int i = 0; i < 12; ++i) {
    place.Photograph("alice", 4 + i, 0, i % 2 == 0 ? 5 : 8, i % 3 == 0 ? 2 : 5);
  }
  place.Locate(metres);
  return place;
}

TEST(PlaceGuidance, OfAPlaceThatGrowsSaysNearlyWhatIsSaidOfItAnew) {
  const GuideOptions options;
  const NoGoAreas no_go;
  PlaceGuide guide(options, no_go);
  TestPlace place(20, 4, 6000);
  for (int i = 0; i < 16; ++i) {
    place.Photograph(i % 2 == 0 ? "alice" : "bob", 2 + i);
    PlaceInput input = place.Input();
    input.shape = place.MakeShape(3, 10 + static_cast<uint64_t>(i));
    const Result<PlaceGuidance> said = guide.Update(input), anew = FirstGuidance(input);
    ASSERT_TRUE(said.ok() && anew.ok());
    EXPECT_EQ(said->place.num_photos, anew->place.num_photos);
    EXPECT_NEAR(said->place.completeness.good_share, anew->place.completeness.good_share, 0.05);
    EXPECT_NEAR(said->place.num_surfels, anew->place.num_surfels,
                5 + 0.2 * anew->place.num_surfels);
    ASSERT_EQ(said->advice.size(), anew->advice.size());
    for (size_t agent = 0; agent < said->advice.size(); ++agent) {
      EXPECT_EQ(said->advice[agent].agent, anew->advice[agent].agent);
      EXPECT_EQ(said->advice[agent].last_image_id, anew->advice[agent].last_image_id);
      EXPECT_EQ(said->advice[agent].stations.empty(), anew->advice[agent].stations.empty());
    }
  }
}

TEST(PlaceGuidance, GpsGivesTheScaleAndTheTarget) {
  GuideOptions options;
  options.target_gsd_mm = 30;
  const PlaceGuidance guidance = Guide(Located(3), options);
  EXPECT_NEAR(guidance.metres_per_unit, 3, 0.03);
  EXPECT_NEAR(guidance.place.completeness.target_gsd, 0.01, 1e-4);
  const PlaceGuidance unknown = Guide(TwoWalks(), options);
  EXPECT_EQ(unknown.metres_per_unit, 0);
  EXPECT_NE(unknown.place.completeness.target_gsd, 0.01);
}

TEST(PlaceGuidance, StationsKeepTheAltitude) {
  GuideOptions options;
  options.altitude = "509:512";  // 3 to 4 units high
  const PlaceGuidance guidance = Guide(Located(3), options);
  ASSERT_EQ(guidance.advice.size(), 1u);
  ASSERT_FALSE(guidance.advice[0].stations.empty());
  for (const AdvisedStation& advised : guidance.advice[0].stations) {
    EXPECT_GT(CentreOf(advised).z(), 2.9);
    EXPECT_LT(CentreOf(advised).z(), 4.1);
  }
}

TEST(PlaceGuidance, StationsKeepOutOfNoGoAreas) {
  const TestPlace place = Located(3);
  const PlaceGuidance free = Guide(place);
  ASSERT_FALSE(free.advice[0].stations.empty());
  // All that lies to the east of where the best viewpoint was, and then everything.
  const Eigen::Vector3d best = CentreOf(free.advice[0].stations[0]);
  const auto at = [](double x, double y) {
    return GeodeticPosition{48 + 3 * y / 111'200.0,
                            11 + 3 * x / (111'320.0 * std::cos(48 * 0.0174533)), 0};
  };
  const auto box = [&](double left) {
    return NoGoAreas{{at(left, -100), at(200, -100), at(200, 100), at(left, 100)}};
  };
  const PlaceGuidance kept_out = Guide(place, {}, box(best.x() - 0.5));
  for (const AdvisedStation& advised : kept_out.advice[0].stations) {
    EXPECT_LT(CentreOf(advised).x(), best.x() - 0.4);
  }
  EXPECT_TRUE(Guide(place, {}, box(-200)).advice[0].stations.empty());
}

TEST(PlaceGuidance, WithoutAPositionLimitsAdviseNothing) {
  GuideOptions options;
  options.altitude = "0:1000";
  const PlaceGuidance guidance = Guide(TwoWalks(), options);
  ASSERT_EQ(guidance.advice.size(), 2u);
  EXPECT_TRUE(guidance.advice[0].stations.empty());
  EXPECT_GT(guidance.place.num_surfels, 50u) << "how complete it is is told all the same";
}

TEST(PlaceGuidance, OfNothingSaysSo) {
  TestPlace place;
  place.Photograph("alice", 2);
  const PlaceGuidance guidance = Guide(place);
  EXPECT_EQ(guidance.place.verdict, PlaceVerdict::kGrowing);
  ASSERT_EQ(guidance.advice.size(), 1u);
  EXPECT_TRUE(guidance.advice[0].stations.empty());
}

}  // namespace skein::place_guidance_test
