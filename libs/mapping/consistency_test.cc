#include "mapping/consistency.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "mapping/misplaced.h"
#include "testing/synthetic_scene.h"

namespace skein {
namespace {

std::vector<ImageId> Range(ImageId first, ImageId last) {
  std::vector<ImageId> ids;
  for (ImageId id = first; id <= last; ++id) ids.push_back(id);
  return ids;
}

// Photos 1 to 12 stand before one wall, 13 to 20 before another. 30 m apart or at one place.
Withdrawal FindIn(SyntheticOptions::Shape shape, std::vector<ImageId>* misplaced) {
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
  *misplaced = FindMisplaced(options.misplaced, map);
  return Consistency(options, map, WaitingPhotos(options, map)).FindMisplacedPhotos(1);
}

// As the sides of a house that look alike: their matches contradict the map, which is right.
TEST(Consistency, PhotosOfASimilarPlaceThatStandWhereTheyShouldStay) {
  std::vector<ImageId> misplaced;
  const Withdrawal found = FindIn(SyntheticOptions::Shape::kTwoPlaces, &misplaced);
  ASSERT_EQ(misplaced, Range(13, 20));
  EXPECT_TRUE(found.photos.empty()) << found.refusal.text;
}

TEST(Consistency, PhotosOfOnePlaceThatStandElsewhereAreMisplaced) {
  std::vector<ImageId> misplaced;
  const Withdrawal found = FindIn(SyntheticOptions::Shape::kWall, &misplaced);
  EXPECT_EQ(found.photos, misplaced);
  EXPECT_EQ(found.photos, Range(13, 20));
  EXPECT_EQ(found.refusal.cause, Refusal::Cause::kContradicted);
}

}  // namespace
}  // namespace skein
