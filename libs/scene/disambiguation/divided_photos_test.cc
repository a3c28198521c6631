#include <gtest/gtest.h>

#include "disambiguation/similar_structures.h"
#include "testing/synthetic_scene.h"

namespace skein::divided_photos_test {

// Two walls with one façade, twelve photos each.
constexpr int kNumOfWall = 12;

std::set<ImageId> Ids(ImageId first, ImageId last) {
  std::set<ImageId> ids;
  for (ImageId id = first; id <= last; ++id) ids.insert(id);
  return ids;
}

class DividedPhotosTest : public testing::Test {
 protected:
  DividedPhotosTest() {
    SyntheticOptions options;
    options.shape = SyntheticOptions::Shape::kTwoPlaces;
    options.num_photos = 2 * kNumOfWall;
    scene_ = MakeScene(options);
    AddToMap(scene_, scene_.pairs, &map_);
  }

  // A model of the whole scene with these photos registered.
  Reconstruction Model(const std::set<ImageId>& ids) {
    RegisterAtTruth(scene_, {ids.begin(), ids.end()}, Eigen::Vector3d::Zero(), &map_);
    return map_.reconstruction();
  }

  SyntheticScene scene_;
  SceneMap map_;
};

TEST_F(DividedPhotosTest, APhotoOfBothBelongsToThatWithMoreOfItsMatches) {
  const DividedPhotos divided =
      DividePhotos(map_, Ids(1, kNumOfWall + 2), Ids(kNumOfWall, 24), Model(Ids(1, 24)));
  EXPECT_EQ(divided.of_first, Ids(1, kNumOfWall));
  EXPECT_EQ(divided.of_second, Ids(kNumOfWall + 1, 24));
}

TEST_F(DividedPhotosTest, APhotoThatTheMergedModelOrBothLackIsOfNeither) {
  const DividedPhotos divided =
      DividePhotos(map_, Ids(1, 6), Ids(8, kNumOfWall), Model(Ids(1, 11)));
  EXPECT_EQ(divided.of_first, Ids(1, 6));
  EXPECT_EQ(divided.of_second, Ids(8, 11));
}

}  // namespace skein::divided_photos_test
