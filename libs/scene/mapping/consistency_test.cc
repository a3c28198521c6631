#include "mapping/consistency.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "mapping/misplaced.h"
#include "mapping/rebuild.h"
#include "testing/synthetic_scene.h"

namespace skein::consistency_test {

std::vector<ImageId> Range(ImageId first, ImageId last) {
  std::vector<ImageId> ids;
  for (ImageId id = first; id <= last; ++id) ids.push_back(id);
  return ids;
}

// Photos 1 to 12 stand before one wall, 13 to 20 before another, or the same, 30 m away.
struct TwoGroups {
  explicit TwoGroups(SyntheticOptions::Shape shape) {
    SyntheticOptions scene_options;
    scene_options.shape = shape;
    scene_options.num_points = 6000;
    scene_options.num_photos = 20;
    const SyntheticScene scene = MakeScene(scene_options);
    SceneMap map;
    AddToMap(scene, scene.pairs, &map);
    RegisterAtTruth(scene, Range(1, 12), Eigen::Vector3d::Zero(), &map);
    RegisterAtTruth(scene, Range(13, 20), Eigen::Vector3d(30, 0, 0), &map);
    const SubmapOptions options;
    const WaitingPhotos waiting(map);
    contradicted = FindMisplaced(map);
    found = Consistency(options, map, waiting).FindMisplacedPhotos(1);
    matches_to_win = CountMatches(options, map, waiting).to_win;
  }

  std::vector<ImageId> contradicted;
  Withdrawal found;
  int64_t matches_to_win;
};

// As the sides of a house that look alike: their matches contradict the map, which is right, and
// no other map should win them.
TEST(Consistency, PhotosOfASimilarPlaceThatStandWhereTheyShouldStay) {
  const TwoGroups groups(SyntheticOptions::Shape::kTwoPlaces);
  ASSERT_EQ(groups.contradicted, Range(13, 20));
  EXPECT_TRUE(groups.found.photos.empty()) << groups.found.refusal.text;
  EXPECT_EQ(groups.matches_to_win, 0);
}

TEST(Consistency, PhotosOfOnePlaceThatStandElsewhereAreMisplaced) {
  const TwoGroups groups(SyntheticOptions::Shape::kWall);
  EXPECT_EQ(groups.contradicted, Range(13, 20));
  EXPECT_EQ(groups.found.photos, Range(13, 20));
  EXPECT_EQ(groups.found.refusal.cause, Refusal::Cause::kContradicted);
  EXPECT_GT(groups.matches_to_win, 1000);
}

}  // namespace skein::consistency_test
