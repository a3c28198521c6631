#include "mapping/model_check.h"

#include <gtest/gtest.h>

#include "map/bundle_builder.h"
#include "testing/synthetic_scene.h"

namespace skein::model_check_test {

double ShareOf(const MatchCheck& check) {
  return static_cast<double>(check.num_contradicting) / check.num_matches;
}

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

TEST(ModelCheck, AtTheTruthNoMatchContradicts) {
  SceneMap map;
  FillMap(MakeScene({}), &map);
  const MatchCheck check = CheckMatches(map);
  EXPECT_GE(check.num_matches, 100 * static_cast<int>(map.pairs().size()));
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
  const MatchCheck check = CheckMatches(map);
  EXPECT_NEAR(ShareOf(check), 12.0 / 28, 0.1);  // of the pairs
  EXPECT_LE(check.strongest1, 6u);
  EXPECT_GE(check.strongest2, 7u);
  EXPECT_GE(check.num_of_strongest, 100);
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
  const MatchCheck check = CheckMatches(map);
  EXPECT_NEAR(ShareOf(check), 12.0 / 28, 0.1);
  EXPECT_GE(check.strongest2, 7u);
  EXPECT_GE(check.num_of_strongest, 30);
}

// As of equal doors along a corridor: many pairs are false, and have few matches.
TEST(ModelCheck, FalsePairsOfARightMapAreFewOfItsMatches) {
  SyntheticOptions options;
  options.shape = SyntheticOptions::Shape::kWall;
  options.num_photos = 12;
  options.num_points = 3000;
  SyntheticScene scene = MakeScene(options);
  constexpr uint32_t kMatches = 40;
  int num_false = 0, num_true = 0;
  for (const TwoViewPairs& pairs : scene.pairs) num_true += static_cast<int>(pairs.size());
  for (size_t i = 9; i < 12; ++i) {
    for (int other = 1; other <= 3; ++other, ++num_false) {
      TwoViewPair pair;
      pair.other_id = other;
      for (uint32_t k = 0; k < kMatches; ++k) pair.inliers.emplace_back(k, k);
      scene.pairs[i].push_back(pair);
    }
  }
  SceneMap map;
  FillMap(scene, &map);
  const MatchCheck check = CheckMatches(map);
  EXPECT_GT(num_false, 0.1 * num_true);
  EXPECT_GT(check.num_contradicting, 0.5 * num_false * kMatches);
  EXPECT_LT(ShareOf(check), 0.05);
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
