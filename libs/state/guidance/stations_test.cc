// Where guidance sends agents on walls of which everything is known.
#include "guidance/stations.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "testing/test_site.h"

namespace skein::stations_test {

TEST(Stations, LookAtTheWeakPart) {
  Site site({FrontWall(-8, 16)});
  for (const double x : {-7.0, -6.0, -5.0, -4.0, -3.0, -2.0}) {
    site.Photograph({x, -8, 2}, {x, 0, 2});
  }
  site.Photograph({2, -8, 2}, {2, 0, 2});
  site.Photograph({2.2, -8, 2}, {2.2, 0, 2});
  const GuidedMap map = site.Map();
  const PlaceQuality place = Assess(map);
  EXPECT_FALSE(place.completeness.complete);
  const auto stations = ChooseStations(map, place, {SeekerAt(map)});
  ASSERT_EQ(stations.size(), 1u);
  ASSERT_FALSE(stations[0].empty());
  const Station& first = stations[0].front();
  EXPECT_GT(first.target.x(), 0);
  EXPECT_GT(first.common_points, 100);
  EXPECT_GT(first.gain, 1);
  const Eigen::Vector3d centre = first.cam_from_world.Centre();
  EXPECT_LT(centre.y(), -4);
  EXPECT_NEAR(centre.z(), 2, 3);
  // Upright, and towards its target.
  EXPECT_GT((first.cam_from_world.rotation.conjugate() * -Eigen::Vector3d::UnitY()).z(), 0.5);
  const Eigen::Vector3d seen = first.cam_from_world.Apply(first.target);
  EXPECT_NEAR(seen.x() / seen.z(), 0, 1e-9);
  EXPECT_NEAR(seen.y() / seen.z(), 0, 1e-9);
}

// A failed photo far away: viewpoints must then see through known space.
VainPhoto VainElsewhere() {
  CameraPose pose;
  pose.translation = {1000, 1000, 1000};
  return {pose, 1e9};
}

TEST(Stations, WhereAPhotoWasInVainNoneIsAdvisedUntilMoreIsKnownThere) {
  const GuidedMap map = SiteOfARow(FrontWall(-8, 16), -2, 2).Map();
  const PlaceQuality place = Assess(map);
  StationSeeker seeker = SeekerAt(map);
  seeker.in_vain = {VainElsewhere()};
  const std::vector<Station> before = ChooseStations(map, place, {seeker})[0];
  ASSERT_GE(before.size(), 2u);
  const Station& best = before[0];
  const auto is_advised = [&] {
    const auto stations = ChooseStations(map, place, {seeker});
    EXPECT_FALSE(stations[0].empty()) << "others are left";
    return std::any_of(stations[0].begin(), stations[0].end(), [&](const Station& station) {
      return HowFar(station.cam_from_world, best.cam_from_world, place.surface.working_distance) <
             0.2;
    });
  };
  seeker.in_vain = {{best.cam_from_world, best.common_points}};
  EXPECT_FALSE(is_advised());
  EXPECT_EQ(ChooseStations(map, place, {seeker})[0].at(0).target, before[1].target)
      << "it goes to another place, not to one beside it";
  seeker.in_vain = {{best.cam_from_world, best.common_points / 2}};
  EXPECT_TRUE(is_advised());
}

// Something may stand where nobody has looked, as among furniture.
TEST(Stations, WhoWasInVainIsSentThroughKnownSpace) {
  const GuidedMap map = SiteOfARow(FrontWall(-8, 16), -2, 2).Map();
  const PlaceQuality place = Assess(map);
  StationSeeker seeker = SeekerAt(map);
  const std::vector<Station> bold = ChooseStations(map, place, {seeker})[0];
  ASSERT_FALSE(bold.empty());
  seeker.in_vain = {VainElsewhere()};
  const std::vector<Station> wary = ChooseStations(map, place, {seeker})[0];
  ASSERT_FALSE(wary.empty());
  const auto from_the_row = [](const Station& station) {
    return std::abs(station.cam_from_world.Centre().x());
  };
  EXPECT_LT(from_the_row(wary[0]), from_the_row(bold[0]));
}

TEST(Stations, AgentsGetDifferentStations) {
  Site site({FrontWall(-8, 16)});
  for (const double x : {-1.0, -0.5, 0.0, 0.5, 1.0}) {
    site.Photograph({x, -8, 2}, {x, 0, 2}, 0);
    site.Photograph({x, -7.5, 2.5}, {x, 0, 2}, 1);
  }
  const GuidedMap map = site.Map();
  const auto stations = ChooseStations(map, Assess(map), {SeekerAt(map, 0), SeekerAt(map, 1)});
  ASSERT_FALSE(stations[0].empty());
  ASSERT_FALSE(stations[1].empty());
  for (const Station& a : stations[0]) {
    for (const Station& b : stations[1]) {
      EXPECT_GT((a.cam_from_world.Centre() - b.cam_from_world.Centre()).norm(), 0.3);
    }
  }
}

TEST(Stations, NobodyIsSentWhereNobodyMayStand) {
  Site site = SiteOfARow(FrontWall(-8, 16), -2, 2);
  const GuidedMap map = site.Map();
  const PlaceQuality place = Assess(map);
  StationSeeker seeker = SeekerAt(map);
  seeker.reach.up = Eigen::Vector3d::UnitZ();
  seeker.reach.min_height = 1.9;
  seeker.reach.max_height = 2.1;
  seeker.reach.no_go = {{{0.5, -20, 0}, {20, -20, 0}, {20, 20, 0}, {0.5, 20, 0}}};
  const auto stations = ChooseStations(map, place, {seeker});
  ASSERT_FALSE(stations[0].empty());
  for (const Station& station : stations[0]) {
    const Eigen::Vector3d centre = station.cam_from_world.Centre();
    EXPECT_LT(centre.x(), 0.5);
    EXPECT_LE(std::abs(centre.z() - 2), 0.1 + 1e-9);
    EXPECT_LT(centre.y(), -1) << "in the wall";
  }
}

// From five photos of its middle, an agent that does what it is told sees all of a wall.
TEST(Stations, WhoFollowsTheStationsCompletesThePlace) {
  Site site({FrontWall(-8, 16)});
  for (const double x : {-1.0, -0.5, 0.0, 0.5, 1.0}) site.Photograph({x, -8, 2}, {x, 0, 2});
  int num_photos = 5;
  PlaceQuality place = Assess(site.Map());
  EXPECT_FALSE(place.completeness.complete);
  const double target_gsd = place.completeness.target_gsd;
  while (!place.completeness.complete && num_photos < 30) {
    const GuidedMap map = site.Map();
    const auto stations = ChooseStations(map, place, {SeekerAt(map)});
    ASSERT_FALSE(stations[0].empty()) << num_photos << " photos";
    const CameraPose& advised = stations[0].front().cam_from_world;
    ASSERT_NEAR(advised.Centre().z(), 2, 0.1) << "a person's camera stays as high as it was";
    site.Photograph(advised);
    ++num_photos;
    place = AssessPlace(site.Map(), target_gsd);
  }
  EXPECT_TRUE(place.completeness.complete);
  EXPECT_GT(place.completeness.area, 0.75 * 16 * 4) << "the whole wall";
  EXPECT_LT(num_photos, 25);
}

// A bench stands under the row, a metre below the photos that are 8 m from the wall: a quarter of
// the working distance is free nowhere.
TEST(Stations, MayBeAsCloseToASurfaceAsPhotosWere) {
  Site site({FrontWall(-8, 16), {{-8, -4, 1}, {16, 0, 0}, {0, -6, 0}}});
  for (const double x : {-2.0, -1.0, 0.0, 1.0, 2.0}) site.Photograph({x, -8, 2}, {x, 0, 2});
  for (const double x : {-6.0, -3.0, 0.0, 3.0, 6.0}) site.Photograph({x, -2, 6}, {x, -8, 1}, 1);
  const GuidedMap map = site.Map();
  const PlaceQuality place = Assess(map);
  ASSERT_GT(0.25 * place.surface.working_distance, 1.5);
  StationSeeker seeker = SeekerAt(map, 0);
  seeker.reach.up = Eigen::Vector3d::UnitZ();
  const auto stations = ChooseStations(map, place, {seeker});
  ASSERT_FALSE(stations[0].empty());
  EXPECT_LT(stations[0][0].cam_from_world.Centre().y(), -4) << "above the bench";
  // Who has never been so close is not sent there.
  seeker = SeekerAt(map, 1);
  seeker.reach = {Eigen::Vector3d::UnitZ(), 1.9, 2.1, {}};
  const auto of_the_other = ChooseStations(map, place, {seeker});
  for (const Station& station : of_the_other[0]) {
    const double y = station.cam_from_world.Centre().y();
    EXPECT_TRUE(y < -10 || y > -4) << "above the bench";
  }
}

}  // namespace skein::stations_test
