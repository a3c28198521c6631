#include "mapping/consistency.h"

#include <gtest/gtest.h>

#include "disambiguation/similar_structures.h"
#include "mapping/misplaced.h"
#include "mapping/rebuild.h"
#include "testing/synthetic_scene.h"
#include "testing/test_random.h"

namespace skein::consistency_test {

std::vector<ImageId> Range(ImageId first, ImageId last) {
  std::vector<ImageId> ids;
  for (ImageId id = first; id <= last; ++id) ids.push_back(id);
  return ids;
}

// Points that these photos see together, of keypoints that leave their own points.
void TieTogether(const std::vector<ImageId>& ids, Point2DIdx num_points, SceneMap* map) {
  for (Point2DIdx i = 0; i < num_points; ++i) {
    Track track;
    for (const ImageId id : ids) {
      if (map->reconstruction().Image(id).Point2D(i).HasPoint3D()) map->DeleteObservation(id, i);
      track.AddElement(id, i);
    }
    map->AddPoint(Eigen::Vector3d::Zero(), track);
  }
}

// Photos 1 to 12 stand before one wall, 13 to 20 before another, or the same, 30 m away.
struct TwoGroups {
  explicit TwoGroups(SyntheticOptions::Shape shape, Point2DIdx num_tying = 0) {
    SyntheticOptions scene_options;
    scene_options.shape = shape;
    scene_options.num_points = 6000;
    scene_options.num_photos = 20;
    const SyntheticScene scene = MakeScene(scene_options);
    SceneMap map;
    AddToMap(scene, scene.pairs, &map);
    RegisterAtTruth(scene, Range(1, 12), Eigen::Vector3d::Zero(), &map);
    RegisterAtTruth(scene, Range(13, 20), Eigen::Vector3d(30, 0, 0), &map);
    TieTogether({11, 12, 13, 14}, num_tying, &map);
    const SubmapOptions options;
    const WaitingPhotos waiting(map);
    contradicted = FindMisplaced(map);
    const Consistency consistency(options, map, waiting);
    found = consistency.FindMisplacedPhotos(1);
    untied = consistency.FindUntiedPhotos();
    matches_to_win = CountMatches(options, map, waiting).to_win;
  }

  std::vector<ImageId> contradicted;
  Withdrawal found;
  std::vector<ImageId> untied;
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

// South-building through a denoiser: between the sides of the house nothing was left but a pair of
// 27 matches. All photos at once made one map of the sides, 18 % of the extent wrong.
TEST(Consistency, APartThatHardlyAnyPointsTieIsUntied) {
  EXPECT_EQ(TwoGroups(SyntheticOptions::Shape::kTwoPlaces, 14).untied, Range(13, 20));
  EXPECT_TRUE(TwoGroups(SyntheticOptions::Shape::kTwoPlaces, 15).untied.empty());
}

TEST(Consistency, PhotosOfOnePlaceThatStandElsewhereAreMisplaced) {
  const TwoGroups groups(SyntheticOptions::Shape::kWall);
  EXPECT_EQ(groups.contradicted, Range(13, 20));
  EXPECT_EQ(groups.found.photos, Range(13, 20));
  EXPECT_EQ(groups.found.refusal.cause, Refusal::Cause::kContradicted);
  EXPECT_GT(groups.matches_to_win, 1000);
}

// The right half of a wall is photographed in two spectral bands: photos 1 to 3 and photos 4 and 5
// see points of their own there, all at the wall's depth. All photos see the points of the left
// half. Later photos see nothing else.
class WallInTwoBands {
 public:
  explicit WallInTwoBands(int num_of_left_half) : random_(1) {
    AddPoints(600, -2, 0, kAll);
    AddPoints(1500, 0, 5, kFirstBand);
    AddPoints(1500, 0, 5, kSecondBand);
    for (int i = 0; i < 3; ++i) AddPhoto(0.6 * i, 0, kFirstBand);
    for (int i = 0; i < 2; ++i) AddPhoto(1.2 * i, 0.1, kSecondBand);
    for (int i = 0; i < num_of_left_half; ++i) AddPhoto(0.3 * i, 0.2, kLeftHalf);
    SyntheticOptions options;
    options.camera.width_px = 1600;
    options.camera.height_px = 1200;
    options.noise_px = 0;
    Photograph(options, &random_, &scene_);
    FillMap(scene_, &map_);
  }

  const SceneMap& map() const { return map_; }

  Withdrawal FindMisplacedPhotos() const {
    const SubmapOptions options;
    const WaitingPhotos waiting(map_);
    return Consistency(options, map_, waiting).FindMisplacedPhotos(1);
  }

 private:
  enum Place { kAll, kFirstBand, kSecondBand, kLeftHalf };

  void AddPoints(int count, double min_x, double max_x, Place place) {
    for (int k = 0; k < count; ++k) {
      const double height = Uniform(-3.5, 3.5, &random_);
      scene_.points.emplace_back(Uniform(min_x, max_x, &random_), height, 0);
      scene_.place_of_point.push_back(place);
    }
  }

  void AddPhoto(double along, double height, Place place) {
    scene_.AddPose(Eigen::Matrix3d::Identity(), {along - 1, height, -8});
    scene_.place_of_photo.push_back(place);
  }

  std::mt19937 random_;
  SyntheticScene scene_;
  SceneMap map_;
};

TEST(Consistency, PhotosThatMostPairsTellToBeOfAnotherPlaceAreWithdrawn) {
  const Withdrawal found = WallInTwoBands(0).FindMisplacedPhotos();
  EXPECT_EQ(found.photos, Range(4, 5));
  EXPECT_EQ(found.refusal.cause, Refusal::Cause::kSimilarPlace);
}

// Such photos would begin a map that is merged with this one, and be withdrawn again.
TEST(Consistency, PhotosThatAMergeWouldJoinAgainStay) {
  const WallInTwoBands wall(5);
  ASSERT_FALSE(FindPhotosOfAnotherPlace(wall.map(), 1).empty());
  EXPECT_TRUE(wall.FindMisplacedPhotos().photos.empty());
}

}  // namespace skein::consistency_test
