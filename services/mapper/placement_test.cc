#include "mapper/placement.h"

#include <gtest/gtest.h>

#include "mapper/bundle_builder.h"
#include "mapper/synthetic_scene.h"

namespace skein {
namespace {

constexpr ImageId kNewPhoto = 8;

// The scene at its truth, with all photos but the last registered and all their points.
class PlacementTest : public testing::Test {
 protected:
  void SetUp() override {
    std::vector<colmap::Track> tracks(scene_.points.size());
    for (size_t i = 0; i < scene_.photos.size(); ++i) {
      ASSERT_TRUE(map_.AddPhoto(scene_.photos[i]).ok());
      ASSERT_TRUE(map_.AddPairs(scene_.photos[i].image_id, scene_.pairs[i]).ok());
      const ImageId id = static_cast<ImageId>(i + 1);
      if (id == kNewPhoto) continue;
      BundlePose pose;
      pose.R = scene_.rotations[i];
      pose.t = scene_.translations[i];
      SetPose(pose, &map_.reconstruction().Image(id));
      map_.Register(id);
      for (size_t k = 0; k < scene_.visible[i].size(); ++k) {
        tracks[scene_.visible[i][k]].AddElement(id, static_cast<Point2DIdx>(k));
      }
    }
    for (size_t p = 0; p < tracks.size(); ++p) {
      if (tracks[p].Length() >= 2) map_.reconstruction().AddPoint3D(scene_.points[p], tracks[p]);
    }
    visible_ = FindVisiblePoints(map_, kNewPhoto);
    estimate_ = EstimatePose(map_, kNewPhoto, visible_, options_);
    ASSERT_TRUE(estimate_.ok) << estimate_.reason;
  }

  double CenterError() const {
    return (map_.reconstruction().Image(kNewPhoto).ProjectionCenter() -
            scene_.Center(kNewPhoto - 1))
        .norm();
  }

  const SyntheticScene scene_ = MakeScene({});
  const RegistrationOptions options_;
  SceneMap map_;
  VisiblePoints visible_;
  PoseEstimate estimate_;
};

// 0.1 of 8 units' distance is more than 4 px.
TEST_F(PlacementTest, RefinesAPoseThatIsOffBeforeTheMatchesAreAsked) {
  estimate_.pose.t += Eigen::Vector3d(0.1, 0.05, 0);
  const Placement placement(estimate_, visible_, kNewPhoto, {}, &map_);
  EXPECT_LT(CenterError(), 0.02);
  EXPECT_TRUE(placement.AgreesWithMatches(options_));
}

// It looks away from all that it is matched with.
TEST_F(PlacementTest, MatchesDisagreeWithAPhotoInTheWrongPlace) {
  estimate_.pose.R =
      Eigen::AngleAxisd(1.5, Eigen::Vector3d::UnitY()).toRotationMatrix() * estimate_.pose.R;
  estimate_.inlier_mask.assign(visible_.size(), false);
  const Placement placement(estimate_, visible_, kNewPhoto, {}, &map_);
  EXPECT_FALSE(placement.AgreesWithMatches(options_));
}

TEST_F(PlacementTest, UndoPutsTheMapBack) {
  const auto points = map_.reconstruction().Points3D();
  const std::vector<double> params = map_.reconstruction().Camera(1).Params();
  estimate_.camera_params[0] *= 1.1;
  Placement placement(estimate_, visible_, kNewPhoto, {}, &map_);
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

}  // namespace
}  // namespace skein
