#include "mapping/found_poses.h"

#include <gtest/gtest.h>

#include "mapping/guest_photos.h"
#include "testing/synthetic_scene.h"

namespace skein::found_poses_test {

// The scene at its truth, with all photos but 7 and 8 registered. Photo 7 was compared.
class FoundPosesTest : public testing::Test {
 protected:
  FoundPosesTest() {
    AddToMap(scene_, scene_.pairs, &map_);
    RegisterAtTruth(scene_, {1, 2, 3, 4, 5, 6}, Eigen::Vector3d::Zero(), &map_);
    estimate_ = found_.Estimate(map_, 7, FindVisiblePoints(map_, 7), {});
    found_.BeginNext();
  }
  bool Knows(ImageId id) const { return found_.Knows(map_, id, FindVisiblePoints(map_, id), {}); }

  const SyntheticScene scene_ = MakeScene({});
  SceneMap map_;
  FoundPoses found_;
  PoseEstimate estimate_;
};

TEST_F(FoundPosesTest, APoseIsKnownAtTheNextComparison) {
  ASSERT_TRUE(estimate_.ok);
  EXPECT_TRUE(Knows(7));
  EXPECT_FALSE(Knows(8)) << "it was not compared";
  const PoseEstimate again = found_.Estimate(map_, 7, FindVisiblePoints(map_, 7), {});
  EXPECT_EQ(again.pose.t, estimate_.pose.t);
  EXPECT_EQ(again.inlier_mask, estimate_.inlier_mask);
  found_.BeginNext();
  EXPECT_TRUE(Knows(7));
  found_.BeginNext();
  EXPECT_FALSE(Knows(7)) << "it was in no comparison since";
}

TEST_F(FoundPosesTest, GuestsThatHaveLeftChangeNothing) {
  {
    GuestPhotos guests(&map_);
    guests.Place(8, {});
    ASSERT_EQ(guests.size(), 1);
    EXPECT_FALSE(Knows(7));
  }
  EXPECT_TRUE(Knows(7));
}

TEST_F(FoundPosesTest, APoseIsNotKnownOncePointsHaveMoved) {
  const VisiblePoints visible = FindVisiblePoints(map_, 7);
  map_.SetPoint(visible.point3D_ids[0], visible.xyz[0] + Eigen::Vector3d(1e-9, 0, 0));
  EXPECT_FALSE(Knows(7));
}

TEST_F(FoundPosesTest, APoseIsNotKnownToAStricterTrial) {
  TrialContext strict;
  strict.matches_similar_place = true;
  EXPECT_FALSE(found_.Knows(map_, 7, FindVisiblePoints(map_, 7), strict));
}

}  // namespace skein::found_poses_test
