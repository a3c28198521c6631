#include "mapping/placement.h"

#include <gtest/gtest.h>

#include "testing/synthetic_scene.h"

namespace skein::placement_test {

constexpr ImageId kNewPhoto = 8;

// The scene at its truth, with all photos but the last registered and all their points.
class PlacementTest : public testing::Test {
 protected:
  void SetUp() override {
    AddToMap(scene_, scene_.pairs, &map_);
    RegisterAtTruth(scene_, {1, 2, 3, 4, 5, 6, 7}, Eigen::Vector3d::Zero(), &map_);
    visible_ = FindVisiblePoints(map_, kNewPhoto);
    estimate_ = EstimatePose(map_, kNewPhoto, visible_);
    ASSERT_TRUE(estimate_.ok) << estimate_.refusal.text;
  }

  double CenterError() const {
    return (map_.reconstruction().Image(kNewPhoto).ProjectionCenter() -
            scene_.Center(kNewPhoto - 1))
        .norm();
  }

  const SyntheticScene scene_ = MakeScene({});
  SceneMap map_;
  VisiblePoints visible_;
  PoseEstimate estimate_;
};

// 0.1 of 8 units' distance is more than 4 px.
TEST_F(PlacementTest, RefinesAPoseThatIsOffBeforeTheMatchesAreAsked) {
  estimate_.pose.t += Eigen::Vector3d(0.1, 0.05, 0);
  const Placement placement(estimate_, visible_, kNewPhoto, &map_);
  EXPECT_LT(CenterError(), 0.02);
  EXPECT_TRUE(placement.AgreesWithMatches());
}

// It looks away from all that it is matched with.
TEST_F(PlacementTest, MatchesDisagreeWithAPhotoInTheWrongPlace) {
  estimate_.pose.R =
      Eigen::AngleAxisd(1.5, Eigen::Vector3d::UnitY()).toRotationMatrix() * estimate_.pose.R;
  estimate_.inlier_mask.assign(visible_.size(), false);
  const Placement placement(estimate_, visible_, kNewPhoto, &map_);
  EXPECT_FALSE(placement.AgreesWithMatches());
}

TEST_F(PlacementTest, UndoPutsTheMapBack) {
  const auto points = map_.reconstruction().Points3D();
  const std::vector<double> params = map_.reconstruction().Camera(1).Params();
  estimate_.camera_params[0] *= 1.1;
  Placement placement(estimate_, visible_, kNewPhoto, &map_);
  EXPECT_TRUE(map_.IsRegistered(kNewPhoto));
  placement.Undo();
  EXPECT_FALSE(map_.IsRegistered(kNewPhoto));
  EXPECT_EQ(map_.reconstruction().Camera(1).Params(), params);
  ASSERT_EQ(map_.reconstruction().NumPoints3D(), points.size());
  for (const auto& [id, point] : points) {
    EXPECT_EQ(map_.reconstruction().Point3D(id).XYZ(), point.XYZ());
    EXPECT_EQ(map_.reconstruction().Point3D(id).Track().Length(), point.Track().Length());
  }
}

}  // namespace skein::placement_test
