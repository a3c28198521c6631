#include "map/points_anew.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <map>
#include <set>
#include <utility>
#include <vector>

#include "core/process.h"
#include "map/filters.h"
#include "testing/synthetic_scene.h"

namespace skein::points_anew_test {

using Observations = std::set<std::pair<ImageId, Point2DIdx>>;
using Points = std::map<Observations, std::array<double, 3>>;

Points PointsOf(const SceneMap& map) {
  Points points;
  for (const auto& [id, point] : map.reconstruction().Points3D()) {
    Observations track;
    for (const TrackElement& element : point.Track().Elements()) {
      track.emplace(element.image_id, element.point2D_idx);
    }
    points[track] = {point.X(), point.Y(), point.Z()};
  }
  return points;
}

class PointsAnewTest : public testing::Test {
 protected:
  // Wrong matches join the keypoints of several points.
  static SyntheticOptions Noisy() {
    SyntheticOptions options;
    options.num_photos = 10;
    options.noise_px = 1;
    options.outlier_ratio = 0.05;
    options.detection_rate = 0.7;
    return options;
  }
  // The last photo waits.
  void Fill(SceneMap* map) const {
    AddToMap(scene_, scene_.pairs, map);
    RegisterAtTruth(scene_, {1, 2, 3, 4, 5, 6, 7, 8, 9}, Eigen::Vector3d::Zero(), map);
  }

  const SyntheticScene scene_ = MakeScene(Noisy());
};

// As COLMAP's triangulator does over the whole map, photo by photo.
TEST_F(PointsAnewTest, AreTheSameWithAnyNumberOfThreads) {
  SceneMap whole;
  Fill(&whole);
  for (const Point3DId id : whole.reconstruction().Point3DIds()) whole.DeletePoint(id);
  std::vector<ImageId> images = whole.reconstruction().RegImageIds();
  std::sort(images.begin(), images.end());  // their names are in this order, too
  for (const ImageId id : images) whole.TriangulateImage(id);
  const Points expected = PointsOf(whole);
  ASSERT_GT(expected.size(), 400u);
  for (const int num_threads : {1, 2, 5}) {
    SceneMap map;
    Fill(&map);
    ASSERT_TRUE(TriangulateAnew(num_threads, &map));
    EXPECT_EQ(PointsOf(map), expected) << num_threads;
    EXPECT_TRUE(map.ModifiedPoints().empty());
  }
}

TEST_F(PointsAnewTest, OfSomePairsHaveNoOtherObservations) {
  SceneMap map;
  Fill(&map);
  ImagePairs pairs;
  for (const auto& [id1, id2] : map.pairs()) {
    if (std::max(id1, id2) <= 5) pairs.emplace_back(id1, id2);
  }
  ASSERT_TRUE(TriangulateAnew(2, pairs, &map));
  const Points points = PointsOf(map);
  EXPECT_GT(points.size(), 200u);
  for (const auto& [track, xyz] : points) {
    for (const auto& [image_id, index] : track) EXPECT_LE(image_id, 5u);
  }
}

TEST_F(PointsAnewTest, ThatAreToStopLeaveTheFormerPoints) {
  for (const int num_threads : {1, 3}) {
    SceneMap map;
    Fill(&map);
    const Points before = PointsOf(map);
    int num_asked = 0;
    EXPECT_FALSE(TriangulateAnew(num_threads, &map, [&num_asked] { return ++num_asked == 5; }));
    EXPECT_EQ(num_asked, 5);
    EXPECT_EQ(PointsOf(map), before);
  }
}

// A component may be nearly all that there is: then the calling thread is done long before another.
TEST_F(PointsAnewTest, AreAskedWhetherToStopUntilAllThreadsAreDone) {
  for (const int num_threads : {1, 3}) {
    const int num_photos_done = 9 * 4;  // of each part
    for (const int stop_at : {0, num_photos_done}) {
      SceneMap map;
      Fill(&map);
      map.DeletePoint(AllPoints(map).front());  // it is found again
      const Points before = PointsOf(map);
      int num_asked = 0;
      const auto stop = [&] { return ++num_asked == stop_at; };
      EXPECT_EQ(TriangulateAnew(num_threads, &map, stop), stop_at == 0);
      EXPECT_EQ(num_asked, num_photos_done);
      EXPECT_EQ(PointsOf(map) == before, stop_at > 0);
    }
  }
}

// The highest mark of the process's memory only rises: what one thread needs has raised it before.
TEST(PointsAnew, NeedNoMoreMemoryWithMoreThreads) {
  SyntheticOptions large;
  large.num_points = 15000;
  const SyntheticScene scene = MakeScene(large);
  SceneMap map;
  AddToMap(scene, scene.pairs, &map);
  RegisterAtTruth(scene, map.photos(), Eigen::Vector3d::Zero(), &map);
  int64_t keypoint_bytes = 0;
  for (const ImageId id : map.photos()) {
    keypoint_bytes += map.reconstruction().Image(id).NumPoints2D() * sizeof(Point2D);
  }
  ASSERT_TRUE(TriangulateAnew(1, &map));
  const int64_t before = PeakMemoryBytes();
  ASSERT_TRUE(TriangulateAnew(24, &map));
  EXPECT_LT(PeakMemoryBytes() - before, 8 * keypoint_bytes);
}

}  // namespace skein::points_anew_test
