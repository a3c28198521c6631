#include <gtest/gtest.h>

#include "map/scene_map.h"
#include "sfm/model_io.h"
#include "testing/synthetic_scene.h"

namespace skein::scene_map_changes_test {

TEST(SceneMap, RefusesBadInput) {
  SyntheticScene scene = MakeScene({});
  SceneMap map;
  PhotoInput bad = scene.photos[0];
  bad.image_id = 0;
  EXPECT_FALSE(map.AddPhoto(bad).ok());
  bad = scene.photos[0];
  bad.focal_px = -1;
  EXPECT_FALSE(map.AddPhoto(bad).ok());
  ASSERT_TRUE(map.AddPhoto(scene.photos[0]).ok());
  EXPECT_FALSE(map.AddPhoto(scene.photos[0]).ok());
  TwoViewPair pair;
  pair.other_id = 1;
  EXPECT_FALSE(map.AddPairs(1, {pair}).ok());
  pair.other_id = 2;
  pair.inliers = {{1000000, 0}};
  EXPECT_FALSE(map.AddPairs(1, {pair}).ok());
  EXPECT_FALSE(map.AddPairs(7, {pair}).ok());
  pair.inliers = {{0, 1000000}};
  ASSERT_TRUE(map.AddPairs(1, {pair}).ok());
  EXPECT_TRUE(map.AddPhoto(scene.photos[1]).ok());
  EXPECT_TRUE(map.pairs().empty());
}

class SceneMapChanges : public testing::Test {
 protected:
  void SetUp() override {
    AddToMap(scene_, scene_.pairs, &map_);
    RegisterAtTruth(scene_, {1, 2, 3, 4, 5}, Eigen::Vector3d::Zero(), &map_);
  }
  const Reconstruction& model() const { return map_.reconstruction(); }

  const SyntheticScene scene_ = MakeScene({});
  SceneMap map_;
};

TEST_F(SceneMapChanges, CopyIsWhatAModelFileHolds) {
  const Reconstruction copy = CopyRegistered(model());
  const Result<Reconstruction> read = DecodeModel(EncodeModel(model()));
  ASSERT_TRUE(read.ok());
  EXPECT_FALSE(copy.ExistsImage(6));  // waits
  EXPECT_EQ(copy.RegImageIds(), read->RegImageIds());
  ASSERT_EQ(copy.NumPoints3D(), read->NumPoints3D());
  for (const auto& [id, point] : copy.Points3D()) {
    EXPECT_EQ(point.XYZ(), read->Point3D(id).XYZ());
    EXPECT_EQ(point.Track().Length(), read->Point3D(id).Track().Length());
  }
  for (const ImageId id : copy.RegImageIds()) {
    EXPECT_EQ(copy.Image(id).NumPoints3D(), model().Image(id).NumPoints3D());
    EXPECT_LT((copy.Image(id).Qvec() - model().Image(id).Qvec()).norm(), 1e-12);
    EXPECT_EQ(copy.Image(id).Tvec(), model().Image(id).Tvec());
  }
}

TEST_F(SceneMapChanges, AlignsToAModelInAnotherFrame) {
  Reconstruction other = CopyRegistered(model());
  other.Transform(2.0, Eigen::Matrix3d::Identity(), {3, -1, 2});
  map_.AlignTo(other);
  for (const ImageId id : other.RegImageIds()) {
    EXPECT_LT((model().Image(id).ProjectionCenter() - other.Image(id).ProjectionCenter()).norm(),
              1e-6);
  }
}

TEST_F(SceneMapChanges, ContinuedTracksCountAsModifiedUntilForgotten) {
  map_.ForgetModifiedPoints();
  const Point3DId id = PointsSeenBy(map_, {1}).front();
  const TrackElement last = model().Point3D(id).Track().Elements().back();
  map_.DeleteObservation(last.image_id, last.point2D_idx);
  map_.ContinueTrack(id, last.image_id, last.point2D_idx);
  EXPECT_EQ(map_.ModifiedPoints(), std::vector<Point3DId>{id});
  map_.ForgetModifiedPoints();
  EXPECT_TRUE(map_.ModifiedPoints().empty());
}

}  // namespace skein::scene_map_changes_test
