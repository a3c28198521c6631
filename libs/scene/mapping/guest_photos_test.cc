#include "mapping/guest_photos.h"

#include <gtest/gtest.h>

#include <memory>
#include <vector>

#include "testing/synthetic_scene.h"

namespace skein::guest_photos_test {

// The scene at its truth, with all photos but 7 and 8 registered.
class GuestPhotosTest : public testing::Test {
 protected:
  GuestPhotosTest() {
    AddToMap(scene_, scene_.pairs, &map_);
    RegisterAtTruth(scene_, {1, 2, 3, 4, 5, 6}, Eigen::Vector3d::Zero(), &map_);
  }

  const SyntheticScene scene_ = MakeScene({});
  SceneMap map_;
};

TEST_F(GuestPhotosTest, StandInTheMapUntilTheyAreGone) {
  const auto points = map_.reconstruction().Points3D();
  auto guests = std::make_unique<GuestPhotos>(&map_);
  for (const ImageId id : {7, 8}) guests->Place(id, {});
  EXPECT_EQ(guests->size(), 2);
  for (const ImageId id : {7, 8}) {
    ASSERT_TRUE(map_.IsRegistered(id));
    const Eigen::Vector3d center = map_.reconstruction().Image(id).ProjectionCenter();
    EXPECT_LT((center - scene_.Center(id - 1)).norm(), 0.02);
  }
  guests.reset();
  EXPECT_EQ(map_.reconstruction().NumRegImages(), 6u);
  ASSERT_EQ(map_.reconstruction().NumPoints3D(), points.size());
  for (const auto& [id, point] : points) {
    EXPECT_EQ(map_.reconstruction().Point3D(id).XYZ(), point.XYZ());
    EXPECT_EQ(map_.reconstruction().Point3D(id).Track().Length(), point.Track().Length());
  }
}

// Its matches with 5 and 6 give a right pose, and those with four others contradict that pose.
TEST_F(GuestPhotosTest, AGuestMustPassItsTrial) {
  std::vector<TwoViewPairs> pairs = scene_.pairs;
  for (TwoViewPair& pair : pairs[6]) {
    if (pair.other_id > 4) continue;
    pair.inliers.clear();
    for (uint32_t i = 0; i < 250; ++i) pair.inliers.emplace_back(i, i + 100);
  }
  SceneMap map;
  AddToMap(scene_, pairs, &map);
  RegisterAtTruth(scene_, {1, 2, 3, 4, 5, 6}, Eigen::Vector3d::Zero(), &map);
  GuestPhotos guests(&map);
  guests.Place(7, {});
  EXPECT_EQ(guests.size(), 0);
  EXPECT_FALSE(map.IsRegistered(7));
}

}  // namespace skein::guest_photos_test
