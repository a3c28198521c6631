#include "guide/shape_map.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <map>
#include <memory>
#include <tuple>
#include <vector>

#include "testing/test_place.h"

namespace skein::shape_map_test {

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

// Chunks whose points are the same keep their version.
std::shared_ptr<Shape> ShapeAfter(const Shape& before, const TestPlace& place, uint64_t version) {
  auto shape = place.MakeShape(3, version);
  for (Shape::Chunk& chunk : shape->chunks) {
    const Shape::Chunk* known = before.Find(chunk.id);
    if (known != nullptr && *known->tracks == *chunk.tracks) chunk = *known;
  }
  return shape;
}

// Of each point its photos, in the order of where it is.
std::map<std::tuple<double, double, double>, std::vector<uint32_t>> PointsOf(const GuidedMap& map) {
  std::map<std::tuple<double, double, double>, std::vector<uint32_t>> points;
  for (const GuidedPoint& point : map.points) {
    if (point.photos.empty()) continue;
    points[{point.xyz.x(), point.xyz.y(), point.xyz.z()}] = point.photos;
  }
  return points;
}

TEST(ShapeMap, FollowsTheShapesAndKeepsWhereThingsAre) {
  TestPlace place;
  place.Walk("alice", 2, 4, 3);
  std::shared_ptr<Shape> shape = place.MakeShape(3, 10);
  ShapeMap map;
  ASSERT_TRUE(map.Update(*shape, {}, kAll).ok());
  for (const double x : {5.0, 6.0, 4.5}) {
    const GuidedMap before = map.map();
    place.Photograph("bob", x);
    shape = ShapeAfter(*shape, place, shape->version + 1);
    ASSERT_TRUE(map.Update(*shape, {}, kAll).ok());
    ShapeMap anew;
    ASSERT_TRUE(anew.Update(*shape, {}, kAll).ok());
    ASSERT_EQ(map.map().photos.size(), anew.map().photos.size());
    EXPECT_EQ(PointsOf(map.map()), PointsOf(anew.map()));
    size_t num_kept = 0;
    for (size_t i = 0; i < before.points.size(); ++i) {
      num_kept += before.points[i].xyz == map.map().points[i].xyz;
    }
    // Those that have not come into another chunk, as in a shape of this place some have.
    EXPECT_GT(num_kept, 0.5 * static_cast<double>(before.points.size()));
  }
}

TEST(ShapeMap, KeepsIndicesUntilAPhotoHasGone) {
  TestPlace place;
  place.Walk("alice", 2, 6, 4);
  const auto shape = place.MakeShape(3, 10);
  const auto early = std::make_shared<Shape>(*shape);
  early->photos.erase(early->photos.begin());  // registered later than those that came after it
  ShapeMap map;
  ASSERT_TRUE(map.Update(*early, {}, kAll).ok());
  ASSERT_TRUE(map.Update(*shape, {}, kAll).ok());
  ASSERT_EQ(map.map().photos.size(), 4u);
  EXPECT_EQ(map.map().photos[0].image_id, 2);
  EXPECT_EQ(map.map().photos[3].image_id, 1);
  ShapeMap anew;
  ASSERT_TRUE(anew.Update(*shape, {}, kAll).ok());
  const auto num_of = [](const ShapeMap& of, uint32_t photo) {
    return std::count_if(of.map().points.begin(), of.map().points.end(),
                         [&](const GuidedPoint& point) {
                           return std::count(point.photos.begin(), point.photos.end(), photo) > 0;
                         });
  };
  EXPECT_GT(num_of(anew, 0), 100);
  EXPECT_EQ(num_of(map, 3), num_of(anew, 0)) << "what was observed by a photo that was not there";
  ASSERT_TRUE(map.Update(*early, {}, kAll).ok());
  ASSERT_EQ(map.map().photos.size(), 3u);
  EXPECT_EQ(map.map().photos[0].image_id, 2);
}

TEST(ShapeMap, ThePartOfManyPointsIsHeld) {
  TestPlace place;
  place.Walk("alice", 2, 10, 8);
  const auto shape = place.MakeShape(3, 10);
  ShapeMap map;
  ASSERT_TRUE(map.Update(*shape, {}, 400).ok());
  const double share = map.share();
  ASSERT_TRUE(map.Update(*shape, {}, 380).ok());
  EXPECT_EQ(map.share(), share);
  ASSERT_TRUE(map.Update(*shape, {}, 300).ok());
  EXPECT_NEAR(map.share(), 0.75 * share, 1e-9);
  EXPECT_NEAR(PointsOf(map.map()).size(), 300, shape->chunks.size());
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

}  // namespace skein::shape_map_test
