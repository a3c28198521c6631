#include "dense/sparse_scene.h"

#include <gtest/gtest.h>

#include <limits>

#include "testing/test_wall.h"

namespace skein::sparse_scene_test {

class SparseSceneTest : public testing::Test {
 protected:
  SparseSceneTest() {
    wall_.Walk(3);
    shape_ = *wall_.MakeShape(1, 1);
  }
  TestWall wall_;
  Shape shape_;
  SparseScene scene_;
};

TEST_F(SparseSceneTest, HasThePhotosAndWhatEachSees) {
  ASSERT_TRUE(scene_.Update(shape_).ok());
  EXPECT_EQ(scene_.image_ids(), (std::vector<uint32_t>{1, 2, 3}));
  EXPECT_EQ(scene_.Find(2), 1);
  EXPECT_EQ(scene_.Find(4), -1);
  EXPECT_EQ(scene_.points().size(), shape_.chunks[0].num_points);
  for (const SparsePhoto& photo : scene_.photos()) {
    EXPECT_GT(photo.points.size(), 300u);
    EXPECT_TRUE(std::is_sorted(photo.points.begin(), photo.points.end()));
    EXPECT_LT(photo.points.back(), static_cast<int>(scene_.points().size()));
  }
  EXPECT_NEAR(wall_.Error(scene_.points()[0]), 0, 1e-3);
}

TEST_F(SparseSceneTest, PhotosThatMakeNoSenseAreLeftOut) {
  shape_.photos[0].tvec[1] = std::numeric_limits<double>::quiet_NaN();
  shape_.photos[1].camera_id = 9;
  ASSERT_TRUE(scene_.Update(shape_).ok());
  EXPECT_EQ(scene_.image_ids(), (std::vector<uint32_t>{3}));
  shape_.cameras[0].params.pop_back();
  ASSERT_TRUE(scene_.Update(shape_).ok());
  EXPECT_TRUE(scene_.photos().empty());
}

TEST_F(SparseSceneTest, ADamagedChunkEmptiesIt) {
  ASSERT_TRUE(scene_.Update(shape_).ok());
  shape_.chunks[0].version = 2;
  shape_.chunks[0].points = std::make_shared<const Bytes>(Bytes(50));
  EXPECT_FALSE(scene_.Update(shape_).ok());
  EXPECT_TRUE(scene_.photos().empty());
}

}  // namespace skein::sparse_scene_test
