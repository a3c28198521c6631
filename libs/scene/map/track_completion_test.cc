#include "map/track_completion.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <utility>

#include "map/filters.h"
#include "map/map_access.h"
#include "testing/synthetic_scene.h"

namespace skein::track_completion_test {

constexpr ImageId kNewPhoto = 20;

// Photos that all see the same points, close together, at the truth; the last one is new.
class TrackCompletionTest : public testing::Test {
 protected:
  TrackCompletionTest() : scene_(MakeScene(Options())) {
    AddToMap(scene_, scene_.pairs, &map_);
    RegisterAtTruth(scene_, map_.photos(), Eigen::Vector3d::Zero(), &map_);
    for (const Point3DId id : PointsSeenBy(map_, {kNewPhoto})) {
      MapAccess::Triangulator(&map_).AddModifiedPoint3D(id);
    }
  }

  static SyntheticOptions Options() {
    SyntheticOptions options;
    options.num_photos = kNewPhoto;
    options.num_points = 100;
    options.step_deg = 1;
    return options;
  }

  // The keypoint at which a photo sees one of the scene's points.
  Point2DIdx KeypointOf(ImageId id, int point) const {
    const std::vector<int>& visible = scene_.visible[id - 1];
    return static_cast<Point2DIdx>(std::find(visible.begin(), visible.end(), point) -
                                   visible.begin());
  }
  Point3DId PointAt(ImageId id, int point) const {
    const Point2D& point2D = map_.reconstruction().Image(id).Point2D(KeypointOf(id, point));
    return point2D.HasPoint3D() ? point2D.Point3DId() : kInvalidPoint3DId;
  }
  size_t Length(int point) const {
    return map_.reconstruction().Point3D(PointAt(kNewPhoto, point)).Track().Length();
  }
  void TakeOut(ImageId id, int point) { map_.DeleteObservation(id, KeypointOf(id, point)); }
  // Takes photos [begin, end) out of the point's track.
  void TakeOut(ImageId begin, ImageId end, int point) {
    for (ImageId id = begin; id < end; ++id) TakeOut(id, point);
  }
  void Complete() { CompleteLocally(kNewPhoto, &map_); }

  SyntheticScene scene_;
  SceneMap map_;
};

TEST_F(TrackCompletionTest, ExtendsShortAndLongTracksByWhatTheNewPhotoMatches) {
  TakeOut(1, 3, 5);   // leaves a long track
  TakeOut(1, 13, 6);  // leaves one that is not
  ASSERT_TRUE(IsLongTrack(map_, PointAt(kNewPhoto, 5)));
  ASSERT_FALSE(IsLongTrack(map_, PointAt(kNewPhoto, 6)));
  Complete();
  EXPECT_EQ(Length(5), 20u);
  EXPECT_EQ(Length(6), 20u);
  EXPECT_EQ(PointAt(1, 5), PointAt(kNewPhoto, 5));
}

TEST_F(TrackCompletionTest, DoesNotTakeInWhatIsSeenElsewhere) {
  TakeOut(1, 3, 5);
  const Point2DIdx moved = KeypointOf(1, 5);
  Image& image = MapAccess::Model(&map_).Image(1);
  image.Point2D(moved).SetXY(image.Point2D(moved).XY() + Eigen::Vector2d(20, 0));
  Complete();
  EXPECT_EQ(PointAt(1, 5), kInvalidPoint3DId);
  EXPECT_EQ(Length(5), 19u);
}

TEST_F(TrackCompletionTest, MergesALongTrackWithAnotherOfTheSamePoint) {
  TakeOut(1, 4, 5);
  Track other;
  for (ImageId id = 1; id < 4; ++id) other.AddElement(id, KeypointOf(id, 5));
  map_.AddPoint(scene_.points[5], other);
  const size_t num_points = map_.reconstruction().NumPoints3D();
  Complete();
  EXPECT_EQ(map_.reconstruction().NumPoints3D(), num_points - 1);
  EXPECT_EQ(Length(5), 20u);
  EXPECT_EQ(MapAccess::Triangulator(&map_).GetModifiedPoints3D().count(PointAt(kNewPhoto, 5)), 1u);
}

TEST_F(TrackCompletionTest, DoesNotMergePointsInDifferentPlaces) {
  TakeOut(1, 4, 5);
  Track other;
  for (ImageId id = 1; id < 4; ++id) other.AddElement(id, KeypointOf(id, 5));
  map_.AddPoint(scene_.points[5] + Eigen::Vector3d(1, 0, 0), other);
  const size_t num_points = map_.reconstruction().NumPoints3D();
  Complete();
  EXPECT_EQ(map_.reconstruction().NumPoints3D(), num_points);
}

// The new photo's matches with photo 1 are gone. The matches of other photos are followed for short
// tracks only.
TEST_F(TrackCompletionTest, LooksAroundALongTrackInTheNewPhotoOnly) {
  SyntheticScene scene = scene_;
  TwoViewPairs& pairs = scene.pairs[kNewPhoto - 1];
  pairs.erase(std::find_if(pairs.begin(), pairs.end(),
                           [](const TwoViewPair& pair) { return pair.other_id == 1; }));
  SceneMap map;
  AddToMap(scene, scene.pairs, &map);
  RegisterAtTruth(scene, map.photos(), Eigen::Vector3d::Zero(), &map);
  map.DeleteObservation(1, KeypointOf(1, 5));
  map.DeleteObservation(1, KeypointOf(1, 6));
  for (ImageId id = 2; id < 10; ++id) {
    map.DeleteObservation(id, KeypointOf(id, 6));
  }
  for (const Point3DId id : PointsSeenBy(map, {kNewPhoto})) {
    MapAccess::Triangulator(&map).AddModifiedPoint3D(id);
  }
  CompleteLocally(kNewPhoto, &map);
  EXPECT_FALSE(map.reconstruction().Image(1).Point2D(KeypointOf(1, 5)).HasPoint3D());
  EXPECT_TRUE(map.reconstruction().Image(1).Point2D(KeypointOf(1, 6)).HasPoint3D());
}

TEST_F(TrackCompletionTest, MakesPointsOfTheNewPhotosKeypointsThatHaveNone) {
  map_.DeletePoint(PointAt(kNewPhoto, 7));
  Complete();
  EXPECT_EQ(Length(7), 20u);
}

// Noisy photos with wrong matches, of whose tracks every second observation is taken out, half of
// these into points of their own.
class GrowTracksTest : public testing::Test {
 protected:
  GrowTracksTest() {
    SyntheticOptions options;
    options.num_photos = 10;
    options.noise_px = 1;
    options.outlier_ratio = 0.05;
    const SyntheticScene scene = MakeScene(options);
    AddToMap(scene, scene.pairs, &map_);
    RegisterAtTruth(scene, map_.photos(), Eigen::Vector3d::Zero(), &map_);
    for (const Point3DId id : AllPoints(map_)) Divide(id);
  }

  void Divide(Point3DId id) {
    const Point3D point = map_.reconstruction().Point3D(id);
    const auto& elements = point.Track().Elements();
    Track other;
    for (size_t i = 1; i < elements.size(); i += 2) {
      map_.DeleteObservation(elements[i].image_id, elements[i].point2D_idx);
      if (id % 2 == 0) other.AddElement(elements[i]);
    }
    if (other.Length() >= 2) map_.AddPoint(point.XYZ(), other);
  }

  static std::set<std::set<std::pair<ImageId, Point2DIdx>>> TracksOf(const SceneMap& map) {
    std::set<std::set<std::pair<ImageId, Point2DIdx>>> tracks;
    for (const auto& [id, point] : map.reconstruction().Points3D()) {
      std::set<std::pair<ImageId, Point2DIdx>> track;
      for (const auto& element : point.Track().Elements()) {
        track.emplace(element.image_id, element.point2D_idx);
      }
      tracks.insert(track);
    }
    return tracks;
  }

  SceneMap map_;
};

TEST_F(GrowTracksTest, DoesWhatColmapDoesToAllPoints) {
  const auto map = map_.Clone(), colmaps = map_.Clone();
  Triangulator& triangulator = MapAccess::Triangulator(colmaps.get());
  const size_t num_changed = GrowTracks(1, AllPoints(*map), map.get());
  EXPECT_GT(num_changed, 1000u);
  const auto all = [](const SceneMap& of) { return of.reconstruction().Point3DIds(); };
  size_t expected = triangulator.CompleteTracks(all(*colmaps));
  expected += triangulator.MergeTracks(all(*colmaps));
  EXPECT_NEAR(num_changed, expected, 0.01 * expected);  // who is first takes what two points want
  EXPECT_EQ(map->reconstruction().NumPoints3D(), colmaps->reconstruction().NumPoints3D());
  EXPECT_EQ(MapAccess::Triangulator(map.get()).CompleteTracks(all(*map)), 0u);
  EXPECT_EQ(MapAccess::Triangulator(map.get()).MergeTracks(all(*map)), 0u);
}

TEST_F(GrowTracksTest, IsTheSameWithAnyNumberOfThreads) {
  const auto map = map_.Clone();
  const size_t num_changed = GrowTracks(1, AllPoints(*map), map.get());
  for (const int num_threads : {2, 5}) {
    const auto other = map_.Clone();
    EXPECT_EQ(GrowTracks(num_threads, AllPoints(*other), other.get()), num_changed);
    EXPECT_EQ(TracksOf(*other), TracksOf(*map)) << num_threads;
  }
}

}  // namespace skein::track_completion_test
