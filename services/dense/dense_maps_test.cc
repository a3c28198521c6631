#include "dense/dense_maps.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "formats/dense.h"
#include "testing/test_wall.h"

namespace skein::dense_maps_test {

constexpr int64_t kSubmap = 3, kEnoughBytes = int64_t{1} << 30;

constexpr int64_t kMapBytes = (1 + 3 + 16) * depth_test::kWallWidth * depth_test::kWallHeight;

DenseMaps MapsWithin(int64_t max_bytes) { return {depth_test::kWallWidth, max_bytes}; }

class DenseMapsTest : public testing::Test {
 protected:
  // Until nothing is left to do. Returns the photos of the tasks, in order.
  std::vector<uint32_t> Work(const TestWall& wall, DenseMaps* maps) {
    std::vector<uint32_t> made;
    while (const auto task = maps->Next()) {
      made.push_back(task->image_id);
      for (const uint32_t id : task->wanted) {
        EXPECT_TRUE(maps->SetPhoto(id, wall.Picture(id)).ok());
      }
      maps->Make(*task, ++utime_us_);
      if (made.size() > 100) break;
    }
    while (const auto id = maps->NextToRefine()) maps->Refine(*id, ++utime_us_);
    return made;
  }
  int64_t utime_us_ = 1000;
};

struct Figures {
  int64_t num_points = 0;
  double worst_mean_error = 0;  // of a photo's points, to the wall
};

Figures FiguresOf(const std::map<uint32_t, DensePhotoPoints>& photos, const TestWall& wall,
                  double scale = 1) {
  Figures figures;
  for (const auto& [id, photo] : photos) {
    double sum = 0;
    int count = 0;
    for (const DensePhotoPoints::Chunk& chunk : photo.chunks) {
      const Result<ShapeChunk> points = DecodeShapeChunk(*chunk.bytes);
      EXPECT_TRUE(points.ok());
      EXPECT_EQ(points->points.size(), chunk.num_points);
      for (const ShapePoint& point : points->points) {
        const Eigen::Vector3d steps(point.xyz[0], point.xyz[1], point.xyz[2]);
        const Eigen::Vector3d in_camera =
            photo.scale / scale *
            (Eigen::Vector3d::Map(points->origin.data()) + points->step * steps);
        sum += std::abs(wall.Error(wall.Pose(id).ToWorld(in_camera)));
        ++count;
      }
    }
    figures.num_points += count;
    if (count > 0) figures.worst_mean_error = std::max(figures.worst_mean_error, sum / count);
  }
  return figures;
}

TEST_F(DenseMapsTest, PointsLieOnTheWallThatPhotosShow) {
  TestWall wall;
  wall.Walk(5);
  DenseMaps maps = MapsWithin(kEnoughBytes);
  ASSERT_TRUE(maps.Update(*wall.MakeShape(kSubmap, 1)).ok());
  EXPECT_EQ(maps.num_waiting(), 5u);
  EXPECT_EQ(Work(wall, &maps), (std::vector<uint32_t>{5, 4, 3, 2, 1}));
  EXPECT_EQ(maps.num_waiting(), 0u);
  const auto photos = maps.PointsOfSubmap(kSubmap);
  ASSERT_EQ(photos.size(), 5u);
  for (const auto& [id, photo] : photos) EXPECT_GT(photo.share, 0.05) << id;
  const Figures figures = FiguresOf(photos, wall);
  EXPECT_GT(figures.num_points, depth_test::kWallWidth * depth_test::kWallHeight);
  EXPECT_LT(figures.worst_mean_error, 0.01);
}

TEST_F(DenseMapsTest, AnAdjustmentOfPosesChangesNoChunk) {
  TestWall wall;
  wall.Walk(4);
  DenseMaps maps = MapsWithin(kEnoughBytes);
  ASSERT_TRUE(maps.Update(*wall.MakeShape(kSubmap, 1)).ok());
  Work(wall, &maps);
  const uint64_t changes = maps.changes();
  ASSERT_TRUE(maps.Update(*wall.MakeShape(kSubmap, 2, 1, 0.3)).ok());
  EXPECT_TRUE(Work(wall, &maps).empty());
  EXPECT_EQ(maps.changes(), changes);
}

TEST_F(DenseMapsTest, AMergeIntoALargerFrameScalesChunks) {
  TestWall wall;
  wall.Walk(4);
  DenseMaps maps = MapsWithin(kEnoughBytes);
  ASSERT_TRUE(maps.Update(*wall.MakeShape(kSubmap, 1)).ok());
  Work(wall, &maps);
  const auto before = maps.PointsOfSubmap(kSubmap);
  ASSERT_TRUE(maps.Update(*wall.MakeShape(kSubmap + 1, 2, 2.5)).ok());
  maps.DropSubmap(kSubmap);
  EXPECT_TRUE(Work(wall, &maps).empty());
  EXPECT_TRUE(maps.PointsOfSubmap(kSubmap).empty());
  const auto after = maps.PointsOfSubmap(kSubmap + 1);
  ASSERT_EQ(after.size(), before.size());
  for (const auto& [id, photo] : after) {
    EXPECT_NEAR(photo.scale, 2.5, 0.01);
    ASSERT_EQ(photo.chunks.size(), before.at(id).chunks.size());
    EXPECT_EQ(photo.chunks[0].blob_id, before.at(id).chunks[0].blob_id);
  }
  EXPECT_LT(FiguresOf(after, wall, 2.5).worst_mean_error, 0.01);
}

TEST_F(DenseMapsTest, ConfirmedDepthsHaveTheNewestPoseAndScale) {
  TestWall wall;
  wall.Walk(4);
  DenseMaps maps = MapsWithin(kEnoughBytes);
  ASSERT_TRUE(maps.Update(*wall.MakeShape(kSubmap, 1)).ok());
  Work(wall, &maps);
  const auto before = maps.ConfirmedOf(kSubmap);
  ASSERT_EQ(before.size(), 4u);
  EXPECT_TRUE(before.at(2).has_pixels());
  const cv::Mat1f depth = before.at(2).map.depth.clone();
  ASSERT_TRUE(maps.Update(*wall.MakeShape(kSubmap, 2, 2.5)).ok());
  const ConfirmedMap after = maps.ConfirmedOf(kSubmap).at(2);
  EXPECT_EQ(after.revision, before.at(2).revision);
  EXPECT_NEAR(after.scale, 2.5, 0.01);
  EXPECT_NEAR((after.map.cam_from_world.Centre() - 2.5 * wall.Pose(2).Centre()).norm(), 0, 1e-9);
  EXPECT_NEAR(cv::sum(after.map.depth)[0], after.scale * cv::sum(depth)[0],
              1e-3 * cv::sum(after.map.depth)[0]);
  EXPECT_EQ(cv::norm(before.at(2).map.depth, depth), 0) << "pixels that were given out stay";
  EXPECT_TRUE(maps.ConfirmedOf(kSubmap + 1).empty());
}

// The target's shape may come before the source's last one.
TEST_F(DenseMapsTest, PhotosOfASubmapThatEndedAreInTheOtherThatHasThem) {
  TestWall wall;
  wall.Walk(4);
  DenseMaps maps = MapsWithin(kEnoughBytes);
  ASSERT_TRUE(maps.Update(*wall.MakeShape(kSubmap + 1, 1, 2)).ok());
  ASSERT_TRUE(maps.Update(*wall.MakeShape(kSubmap, 2)).ok());
  Work(wall, &maps);
  EXPECT_EQ(maps.PointsOfSubmap(kSubmap).size(), 4u);
  maps.DropSubmap(kSubmap);
  EXPECT_TRUE(Work(wall, &maps).empty());
  const auto photos = maps.PointsOfSubmap(kSubmap + 1);
  ASSERT_EQ(photos.size(), 4u);
  EXPECT_LT(FiguresOf(photos, wall, 2).worst_mean_error, 0.01);
}

TEST_F(DenseMapsTest, AMapThatSparsePointsContradictIsMadeAgain) {
  TestWall wall, other({10, -0.3});
  wall.Walk(4);
  other.Walk(4);
  DenseMaps maps = MapsWithin(kEnoughBytes);
  ASSERT_TRUE(maps.Update(*wall.MakeShape(kSubmap, 1)).ok());
  Work(wall, &maps);
  ASSERT_TRUE(maps.Update(*other.MakeShape(kSubmap, 2)).ok());
  const auto task = maps.Next();
  ASSERT_TRUE(task);
  EXPECT_TRUE(task->wanted.empty());
}

TEST_F(DenseMapsTest, APhotoThatIsLeftOutIsNobodysNeighbour) {
  TestWall wall;
  wall.Walk(5);
  DenseMaps maps = MapsWithin(kEnoughBytes);
  maps.LeaveOut(3);
  ASSERT_TRUE(maps.Update(*wall.MakeShape(kSubmap, 1)).ok());
  EXPECT_EQ(Work(wall, &maps), (std::vector<uint32_t>{5, 4, 2, 1}));
  maps.LeaveOut(2);
  EXPECT_EQ(maps.PointsOfSubmap(kSubmap).count(2), 0u);
}

TEST_F(DenseMapsTest, TwoPhotosConfirmNothing) {
  TestWall wall;
  wall.Walk(2);
  DenseMaps maps = MapsWithin(kEnoughBytes);
  ASSERT_TRUE(maps.Update(*wall.MakeShape(kSubmap, 1)).ok());
  EXPECT_TRUE(Work(wall, &maps).empty());
  EXPECT_EQ(maps.num_waiting(), 0u);
  wall.Photograph(3);
  ASSERT_TRUE(maps.Update(*wall.MakeShape(kSubmap, 2)).ok());
  EXPECT_EQ(Work(wall, &maps), (std::vector<uint32_t>{3, 2, 1}));
}

// A search for neighbours is linear in the photos, so 10,000 searches take minutes.
TEST_F(DenseMapsTest, APhotoWithoutNeighboursIsProgressToo) {
  TestWall wall;
  wall.Walk(2);
  int num_told = 0;
  DenseMaps maps(depth_test::kWallWidth, kEnoughBytes, [&] { ++num_told; });
  ASSERT_TRUE(maps.Update(*wall.MakeShape(kSubmap, 1)).ok());
  num_told = 0;
  EXPECT_FALSE(maps.Next());
  EXPECT_EQ(num_told, 4) << "each photo: for a map, and for a better one";
}

TEST_F(DenseMapsTest, MapsUsedLongestAgoAreForgottenAndTheirPointsStay) {
  TestWall wall;
  wall.Walk(8);
  // Five photos, each with grey, colours, and two maps of depth and error.
  DenseMaps maps = MapsWithin(5 * kMapBytes);
  ASSERT_TRUE(maps.Update(*wall.MakeShape(kSubmap, 1)).ok());
  EXPECT_EQ(Work(wall, &maps).size(), 8u);
  EXPECT_LE(maps.memory_bytes(), 5 * kMapBytes);
  EXPECT_GE(maps.PointsOfSubmap(kSubmap).size(), 6u);
  EXPECT_LT(FiguresOf(maps.PointsOfSubmap(kSubmap), wall).worst_mean_error, 0.01);
}

TEST_F(DenseMapsTest, PointsOfForgottenMapsAreScaledByAMergeToo) {
  TestWall wall;
  wall.Walk(8);
  DenseMaps maps = MapsWithin(4 * kMapBytes);
  ASSERT_TRUE(maps.Update(*wall.MakeShape(kSubmap, 1)).ok());
  Work(wall, &maps);
  const size_t num_photos = maps.PointsOfSubmap(kSubmap).size();
  EXPECT_GE(num_photos, 5u);
  ASSERT_TRUE(maps.Update(*wall.MakeShape(kSubmap + 1, 2, 2.5)).ok());
  maps.DropSubmap(kSubmap);
  const auto photos = maps.PointsOfSubmap(kSubmap + 1);
  EXPECT_EQ(photos.size(), num_photos);
  EXPECT_LT(FiguresOf(photos, wall, 2.5).worst_mean_error, 0.01);
}

TEST_F(DenseMapsTest, ARefinedCameraMakesMapsAgainOnce) {
  TestWall wall;
  wall.Walk(4);
  DenseMaps maps = MapsWithin(kEnoughBytes);
  ASSERT_TRUE(maps.Update(*wall.MakeShape(kSubmap, 1)).ok());
  Work(wall, &maps);
  Shape refined = *wall.MakeShape(kSubmap, 2);
  for (double& value : refined.cameras[0].params) value *= 1.03;
  ASSERT_TRUE(maps.Update(refined).ok());
  EXPECT_EQ(Work(wall, &maps).size(), 4u);
  ASSERT_TRUE(maps.Update(refined).ok());
  EXPECT_TRUE(Work(wall, &maps).empty());
}

TEST_F(DenseMapsTest, APhotoThatDoesNotComeIsNotAskedForAgainBeforeTheNextShape) {
  TestWall wall;
  wall.Walk(3);
  DenseMaps maps = MapsWithin(kEnoughBytes);
  ASSERT_TRUE(maps.Update(*wall.MakeShape(kSubmap, 1)).ok());
  for (int i = 0; i < 3; ++i) {
    const auto task = maps.Next();
    ASSERT_TRUE(task) << i;
    maps.Make(*task, ++utime_us_);
  }
  EXPECT_FALSE(maps.Next());
  ASSERT_TRUE(maps.Update(*wall.MakeShape(kSubmap, 2)).ok());
  EXPECT_TRUE(maps.Next());
}

TEST_F(DenseMapsTest, AShapeWithoutItsPointsIsRefused) {
  TestWall wall;
  wall.Walk(3);
  Shape shape = *wall.MakeShape(kSubmap, 1);
  shape.chunks[0].tracks = nullptr;
  DenseMaps maps = MapsWithin(kEnoughBytes);
  EXPECT_FALSE(maps.Update(shape).ok());
  EXPECT_FALSE(maps.Next());
}

TEST_F(DenseMapsTest, APhotoOfAnotherSizeIsRefused) {
  TestWall wall;
  wall.Walk(3);
  DenseMaps maps = MapsWithin(kEnoughBytes);
  ASSERT_TRUE(maps.Update(*wall.MakeShape(kSubmap, 1)).ok());
  EXPECT_FALSE(maps.SetPhoto(1, cv::Mat3b(77, 99)).ok());
}

}  // namespace skein::dense_maps_test
