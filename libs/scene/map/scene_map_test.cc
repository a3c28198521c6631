#include "map/scene_map.h"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <set>
#include <utility>

#include "testing/synthetic_scene.h"

namespace skein::scene_map_test {

class SceneMapTest : public testing::Test {
 protected:
  // The graph's correspondences of two photos, by keypoint.
  std::set<std::pair<Point2DIdx, Point2DIdx>> GraphMatches(ImageId from, ImageId to) const {
    std::set<std::pair<Point2DIdx, Point2DIdx>> matches;
    for (Point2DIdx i = 0; i < map_.reconstruction().Image(from).NumPoints2D(); ++i) {
      for (const auto& match : map_.graph().FindCorrespondences(from, i)) {
        if (match.image_id == to) matches.emplace(i, match.point2D_idx);
      }
    }
    return matches;
  }

  const SyntheticScene scene_ = MakeScene({});
  SceneMap map_;
};

TEST_F(SceneMapTest, RefusesPhotosThatColmapWouldAbortOn) {
  ASSERT_TRUE(map_.AddPhoto(scene_.photos[0]).ok());
  EXPECT_FALSE(map_.AddPhoto(scene_.photos[0]).ok()) << "a second photo of an id";
  const auto refused = [&](const std::function<void(PhotoInput*)>& change) {
    PhotoInput photo = scene_.photos[1];
    change(&photo);
    return !map_.AddPhoto(photo).ok();
  };
  EXPECT_TRUE(refused([](PhotoInput* p) { p->image_id = -1; }));
  EXPECT_TRUE(refused([](PhotoInput* p) { p->camera_id = int64_t{1} << 40; }));
  EXPECT_TRUE(refused([](PhotoInput* p) { p->width_px = 0; }));
  EXPECT_TRUE(refused([](PhotoInput* p) { p->focal_px = std::nan(""); }));
  EXPECT_TRUE(refused([](PhotoInput* p) { p->keypoints[3].x = std::nanf(""); }));
  EXPECT_FALSE(refused([](PhotoInput*) {}));
}

TEST_F(SceneMapTest, RefusesPairsOutOfRange) {
  ASSERT_TRUE(map_.AddPhoto(scene_.photos[0]).ok());
  ASSERT_TRUE(map_.AddPhoto(scene_.photos[1]).ok());
  TwoViewPairs pairs = scene_.pairs[1];
  pairs[0].inliers[0].second = static_cast<uint32_t>(scene_.photos[0].keypoints.size());
  EXPECT_FALSE(map_.AddPairs(2, pairs).ok());
  EXPECT_FALSE(map_.AddPairs(9, scene_.pairs[1]).ok()) << "of an image that is not there";
}

TEST_F(SceneMapTest, APairWaitsForItsPhotoAndCountsOnce) {
  TwoViewPairs pairs = scene_.pairs[1];
  ASSERT_TRUE(map_.AddPhoto(scene_.photos[1]).ok());
  ASSERT_TRUE(map_.AddPairs(2, pairs).ok());
  EXPECT_TRUE(map_.pairs().empty());
  ASSERT_TRUE(map_.AddPhoto(scene_.photos[0]).ok());
  ASSERT_TRUE(map_.AddPairs(2, pairs).ok());
  EXPECT_EQ(map_.pairs().size(), 1u);
  EXPECT_EQ(GraphMatches(1, 2).size(), pairs[0].inliers.size());
  EXPECT_EQ(map_.Neighbours(1).at(2), static_cast<int>(pairs[0].inliers.size()));
}

TEST_F(SceneMapTest, ThePairsMatchesAreThoseOfTheGraphBothWays) {
  AddToMap(scene_, scene_.pairs, &map_);
  const std::unique_ptr<SceneMap> clone = map_.Clone();
  for (const auto& [id1, id2] : map_.pairs()) {
    for (const auto& [from, to] : {std::pair(id1, id2), std::pair(id2, id1)}) {
      std::set<std::pair<Point2DIdx, Point2DIdx>> of_pair;
      for (const auto& match : clone->MatchesOfPair(from, to)) {
        of_pair.emplace(match.point2D_idx1, match.point2D_idx2);
      }
      EXPECT_EQ(of_pair, GraphMatches(from, to));
    }
  }
  EXPECT_TRUE(map_.MatchesOfPair(1, 1).empty());
}

TEST_F(SceneMapTest, DeregisteringTakesTheObservationsOut) {
  AddToMap(scene_, scene_.pairs, &map_);
  RegisterAtTruth(scene_, map_.photos(), Eigen::Vector3d::Zero(), &map_);
  map_.Deregister(4);
  EXPECT_FALSE(map_.IsRegistered(4));
  EXPECT_TRUE(PointsSeenBy(map_, {4}).empty());
  for (const ImageId id : ObserversOf(map_, PointsSeenBy(map_, {3, 5}))) EXPECT_NE(id, 4u);
}

TEST_F(SceneMapTest, ACameraOfItsOwnStartsFromThePriorAndGoesWithThePhoto) {
  AddToMap(scene_, scene_.pairs, &map_);
  const std::vector<double> prior = map_.camera_state(1).prior_params;
  std::vector<double> refined = prior;
  refined[0] += 50;
  map_.SetCamera(1, refined);
  map_.GiveOwnCamera(3);
  map_.Register(3);
  const CameraId own = map_.reconstruction().Image(3).CameraId();
  EXPECT_EQ(own, SceneMap::OwnCamera(3));
  EXPECT_EQ(map_.GivenCamera(3), 1u);
  EXPECT_EQ(map_.reconstruction().Camera(own).Params(), prior);
  map_.SetCamera(own, refined);

  const std::unique_ptr<SceneMap> clone = map_.Clone();
  map_.Deregister(3);
  EXPECT_EQ(map_.reconstruction().Image(3).CameraId(), 1u);
  EXPECT_EQ(map_.reconstruction().Camera(own).Params(), prior);

  map_.ReplaceRegistered(clone->reconstruction());
  EXPECT_EQ(map_.reconstruction().Image(3).CameraId(), own);
  EXPECT_EQ(map_.reconstruction().Camera(own).Params(), refined);
}

TEST_F(SceneMapTest, AClonesChangesStayItsOwn) {
  AddToMap(scene_, scene_.pairs, &map_);
  RegisterAtTruth(scene_, map_.photos(), Eigen::Vector3d::Zero(), &map_);
  const size_t num_points = map_.reconstruction().NumPoints3D();
  const std::unique_ptr<SceneMap> clone = map_.Clone();
  EXPECT_EQ(clone->reconstruction().NumPoints3D(), num_points);
  clone->Clear();
  EXPECT_EQ(clone->reconstruction().NumRegImages(), 0u);
  EXPECT_EQ(map_.reconstruction().NumPoints3D(), num_points);
  EXPECT_TRUE(map_.IsRegistered(1));
}

TEST(Without, KeepsTheOrder) {
  EXPECT_EQ(Without({1, 3, 5, 7}, {3, 4, 7}), (std::vector<Point3DId>{1, 5}));
  EXPECT_TRUE(Without({}, {1}).empty());
}

}  // namespace skein::scene_map_test
