#include "guide/shape_map.h"

#include <gtest/gtest.h>

#include <limits>

#include "guide/test_place.h"

namespace skein {
namespace {

constexpr int64_t kAll = 1'000'000;

TEST(ShapeMap, HasThePhotosAndPointsOfTheShapeWithWhoSeesThem) {
  TestPlace place;
  place.Walk("alice", 2, 6, 3);
  place.Walk("bob", 4, 8, 3);
  const auto shape = place.MakeShape(3, 10);
  ShapeMap shape_map;
  const Status made =
      shape_map.Update(*shape, {{1, 1}, {2, 1}, {3, 1}, {4, 2}, {5, 2}, {6, 2}}, kAll);
  ASSERT_TRUE(made.ok()) << made.error();
  const GuidedMap& map = shape_map.map();
  EXPECT_EQ(shape_map.share(), 1);
  ASSERT_EQ(map.photos.size(), 6u);
  ASSERT_EQ(map.cameras.size(), 1u);
  EXPECT_EQ(map.photos[3].image_id, 4);
  EXPECT_EQ(map.photos[3].agent, 2);
  EXPECT_TRUE(map.photos[3].cam_from_world.Centre().isApprox(Eigen::Vector3d(4, -5, 2), 1e-9));
  size_t num_points = 0;
  for (const Shape::Chunk& chunk : shape->chunks) num_points += chunk.num_points;
  ASSERT_EQ(map.points.size(), num_points);
  for (const GuidedPoint& point : map.points) {
    ASSERT_GE(point.photos.size(), 2u);
    Eigen::Vector2d pixel;
    for (const uint32_t photo : point.photos) {
      EXPECT_TRUE(
          map.cameras[0].Project(map.photos[photo].cam_from_world.Apply(point.xyz), &pixel));
    }
  }
}

TEST(ShapeMap, OfManyPointsTakesAPartOfEachChunk) {
  TestPlace place;
  place.Walk("alice", 2, 10, 8);
  const auto shape = place.MakeShape(3, 10);
  ShapeMap all, part;
  ASSERT_TRUE(all.Update(*shape, {}, kAll).ok() && part.Update(*shape, {}, 400).ok());
  EXPECT_NEAR(part.map().points.size(), 400, shape->chunks.size());
  EXPECT_NEAR(part.share(), 400.0 / all.map().points.size(), 1e-9);
}

TEST(ShapeMap, LeavesOutWhatMakesNoSense) {
  TestPlace place;
  place.Walk("alice", 2, 6, 4);
  const auto shape = place.MakeShape(3, 10);
  shape->photos[0].tvec[1] = std::numeric_limits<double>::quiet_NaN();
  shape->photos[1].camera_id = 9;  // no such camera
  shape->photos[2].qvec = {0, 0, 0, 0};
  shape->cameras.push_back({7, 0, 900, 1000, 1000, 600, 450});
  ShapeMap made;
  ASSERT_TRUE(made.Update(*shape, {}, kAll).ok());
  ASSERT_EQ(made.map().photos.size(), 1u);
  EXPECT_EQ(made.map().photos[0].image_id, 4);
  for (const GuidedPoint& point : made.map().points) {
    EXPECT_EQ(point.photos, std::vector<uint32_t>{0});
  }
}

TEST(ShapeMap, WithoutTracksThereIsNone) {
  TestPlace place;
  place.Walk("alice", 2, 6, 4);
  const auto shape = place.MakeShape(3, 10);
  shape->chunks[0].tracks = nullptr;
  EXPECT_EQ(ShapeMap().Update(*shape, {}, kAll).code, StatusCode::kNotFound);
  shape->chunks[0].tracks = shape->chunks.back().points;
  EXPECT_EQ(ShapeMap().Update(*shape, {}, kAll).code, StatusCode::kDataLoss);
}

}  // namespace
}  // namespace skein
