#include "mapping/model_check.h"

#include <gtest/gtest.h>

#include "map/bundle_builder.h"
#include "testing/synthetic_scene.h"

namespace skein::model_check_test {

TEST(ModelCheck, OfAStiffMapTheExpectedErrorIsSmall) {
  SceneMap map;
  FillMap(MakeScene({}), &map);
  const ShapeCheck check = CheckShape(BuildGlobalBundle(map, true));
  EXPECT_GT(check.position_sigma, 0);
  EXPECT_LT(check.position_sigma, 0.01);
}

// Photos 1 to 6 and 7 to 12 along a wall: those two groups see points of their own, and 6 in
// common.
TEST(ModelCheck, OfAMapThatHangsTogetherByAFewPointsThePlaceIsNotDetermined) {
  SyntheticOptions options;
  options.shape = SyntheticOptions::Shape::kWall;
  options.num_photos = 12;
  SyntheticScene scene = MakeScene(options);
  SceneMap stiff;
  FillMap(scene, &stiff);
  const double sigma = CheckShape(BuildGlobalBundle(stiff, true)).position_sigma;
  constexpr double kBetweenX = kWallLength * 5.5 / 11;
  int num_common = 0;
  for (size_t p = 0; p < scene.points.size(); ++p) {
    const bool is_common = std::abs(scene.points[p].x() - kBetweenX) < 3 && ++num_common <= 6;
    scene.place_of_point[p] = is_common ? 0 : scene.points[p].x() < kBetweenX ? 1 : 2;
  }
  for (int i = 0; i < 12; ++i) scene.place_of_photo[i] = i < 6 ? 1 : 2;
  std::mt19937 random(1);
  scene.photos.clear();
  scene.visible.clear();
  scene.pairs.clear();
  Photograph(options, &random, &scene);
  SceneMap map;
  FillMap(scene, &map);
  const ShapeCheck check = CheckShape(BuildGlobalBundle(map, true));
  EXPECT_LT(sigma, 1);
  EXPECT_EQ(check.position_sigma, 1);
  EXPECT_EQ(std::min(check.loose_image, check.anchor_image), 6u);
  EXPECT_EQ(std::max(check.loose_image, check.anchor_image), 7u);
  EXPECT_EQ(check.num_loose_images, 6);
}

TEST(ModelCheck, TwoPhotosHaveNoShape) {
  SyntheticOptions options;
  options.num_photos = 2;
  SceneMap map;
  FillMap(MakeScene(options), &map);
  EXPECT_EQ(CheckShape(BuildGlobalBundle(map, true)).position_sigma, 0);
}

TEST(ModelCheck, AtTheTruthNoPairContradicts) {
  SceneMap map;
  FillMap(MakeScene({}), &map);
  const PairCheck check = CheckPairs(map);
  EXPECT_EQ(check.num_pairs, static_cast<int>(map.pairs().size()));
  EXPECT_EQ(check.num_contradicting, 0);
  EXPECT_EQ(check.strongest1, 0u);
}

// Photos 7 and 8 are folded to where they don't belong, with points of their own.
TEST(ModelCheck, OfAFoldThePairsAcrossItContradict) {
  const SyntheticScene scene = MakeScene({});
  SceneMap map;
  AddToMap(scene, scene.pairs, &map);
  RegisterAtTruth(scene, {1, 2, 3, 4, 5, 6}, Eigen::Vector3d::Zero(), &map);
  RegisterAtTruth(scene, {7, 8}, Eigen::Vector3d(3, 0, 0), &map);
  const PairCheck check = CheckPairs(map);
  EXPECT_EQ(check.num_contradicting, 12);
  EXPECT_LE(check.strongest1, 6u);
  EXPECT_GE(check.strongest2, 7u);
  EXPECT_GE(check.num_contradicting_matches, 100);
}

// Photos 7 and 8 stand so little off that all reprojects, but what they see with the others has
// points of its own: so a hand-held video looked in which a part has another scale.
TEST(ModelCheck, TornPairsContradictThoughTheyReproject) {
  const SyntheticScene scene = MakeScene({});
  SceneMap map;
  AddToMap(scene, scene.pairs, &map);
  RegisterAtTruth(scene, {1, 2, 3, 4, 5, 6}, Eigen::Vector3d::Zero(), &map);
  RegisterAtTruth(scene, {7, 8}, Eigen::Vector3d(0.002, 0, 0), &map);
  EXPECT_EQ(CountVotes(map, 6, 7).contradict, 0);
  EXPECT_TRUE(IsTorn(CountCommonPoints(map, 6, 7)));
  EXPECT_FALSE(IsTorn(CountCommonPoints(map, 5, 6)));
  const PairCheck check = CheckPairs(map);
  EXPECT_EQ(check.num_contradicting, 12);
  EXPECT_GE(check.strongest2, 7u);
  EXPECT_GE(check.num_contradicting_matches, 30);
}

// As along a row of equal windows. A photo shows the two windows that others' matches take for one.
TEST(ModelCheck, MatchesOfPointsSeenApartContradictNothing) {
  SyntheticOptions options;
  options.outlier_ratio = 0.5;
  SceneMap map;
  FillMap(MakeScene(options), &map);
  EXPECT_FALSE(IsTorn(CountCommonPoints(map, 6, 7)));
}

}  // namespace skein::model_check_test
