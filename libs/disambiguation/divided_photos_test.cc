#include "disambiguation/divided_photos.h"

#include <gtest/gtest.h>

#include <numeric>

#include "testing/synthetic_scene.h"

namespace skein::divided_photos_test {

// Two walls with one façade, twelve photos each.
constexpr int kNumOfWall = 12;

std::vector<ImageId> Ids(ImageId first, ImageId last) {
  std::vector<ImageId> ids(last - first + 1);
  std::iota(ids.begin(), ids.end(), first);
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
  Reconstruction Model(const std::vector<ImageId>& ids) {
    map_.Clear();
    RegisterAtTruth(scene_, ids, Eigen::Vector3d::Zero(), &map_);
    return map_.reconstruction();
  }

  SyntheticScene scene_;
  SceneMap map_;
};

TEST_F(DividedPhotosTest, APhotoOfBothModelsBelongsToThatWithMoreOfItsMatches) {
  const Reconstruction first = Model(Ids(1, kNumOfWall + 2)), second = Model(Ids(kNumOfWall, 24));
  const DividedPhotos divided = DividePhotos(map_, first, second, Model(Ids(1, 24)));
  const std::vector<ImageId> wall1 = Ids(1, kNumOfWall), wall2 = Ids(kNumOfWall + 1, 24);
  EXPECT_EQ(divided.of_first, std::set<ImageId>(wall1.begin(), wall1.end()));
  EXPECT_EQ(divided.of_second, std::set<ImageId>(wall2.begin(), wall2.end()));
}

TEST_F(DividedPhotosTest, APhotoThatTheMergedModelLacksIsOfNeither) {
  const Reconstruction first = Model(Ids(1, 6)), second = Model(Ids(7, kNumOfWall));
  const DividedPhotos divided = DividePhotos(map_, first, second, Model(Ids(1, 11)));
  EXPECT_EQ(divided.of_first.size(), 6);
  EXPECT_EQ(divided.of_second, (std::set<ImageId>{7, 8, 9, 10, 11}));
}

}  // namespace skein::divided_photos_test
