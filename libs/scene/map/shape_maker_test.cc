#include "map/shape_maker.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <set>

#include "testing/synthetic_scene.h"

namespace skein::shape_maker_test {

constexpr int kChunkPoints = 100;

// Points 1..n uniformly in a cube, point i seen by photos 1..2 + i % 3.
ShapeSource Cube(int num_points, double side = 10, unsigned seed = 1) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> place(0, side);
  ShapeSource source;
  for (int i = 1; i <= num_points; ++i) {
    const auto grey = static_cast<uint8_t>(i % 256);
    source.points.push_back({static_cast<uint64_t>(i),
                             {place(random), place(random), place(random)},
                             {grey, grey, grey}});
    for (uint32_t photo = 1; photo <= 2u + i % 3; ++photo) {
      source.tracks.observations.push_back({photo, static_cast<uint32_t>(i)});
    }
    source.tracks.ends.push_back(static_cast<uint32_t>(source.tracks.observations.size()));
  }
  source.photos = {{1, 1, {1, 0, 0, 0}, {0, 0, 0}}};
  source.cameras = {{1, 640, 480, 500, 500, 320, 240}};
  return source;
}

// Keeps those that `keep(point)`, with their tracks.
template <class Keep>
ShapeSource Only(const ShapeSource& source, Keep keep) {
  ShapeSource kept = source;
  kept.points.clear();
  kept.tracks = {};
  for (size_t i = 0; i < source.points.size(); ++i) {
    if (!keep(source.points[i])) continue;
    kept.points.push_back(source.points[i]);
    const uint32_t begin = i == 0 ? 0 : source.tracks.ends[i - 1];
    for (uint32_t k = begin; k < source.tracks.ends[i]; ++k) {
      kept.tracks.observations.push_back(source.tracks.observations[k]);
    }
    kept.tracks.ends.push_back(static_cast<uint32_t>(kept.tracks.observations.size()));
  }
  return kept;
}

ShapeSource Shuffled(const ShapeSource& source) {
  std::vector<uint64_t> order;
  for (const auto& point : source.points) order.push_back(point.id);
  std::shuffle(order.begin(), order.end(), std::mt19937(7));
  ShapeSource shuffled = Only(source, [](const auto&) { return false; });
  for (const uint64_t id : order) {
    const ShapeSource one = Only(source, [id](const auto& point) { return point.id == id; });
    shuffled.points.push_back(one.points.front());
    for (const auto& observation : one.tracks.observations) {
      shuffled.tracks.observations.push_back(observation);
    }
    shuffled.tracks.ends.push_back(static_cast<uint32_t>(shuffled.tracks.observations.size()));
  }
  return shuffled;
}

struct Shown {
  std::array<double, 3> xyz;
  uint8_t grey;
  uint8_t num_photos;
  double step;
};

// By the keypoint index of their observations, which is their id here.
std::map<uint64_t, Shown> PointsOf(const MapShape& shape) {
  std::map<uint64_t, Shown> points;
  for (const auto& [id, chunk] : shape.chunks) {
    const auto decoded = DecodeShapeChunk(*chunk.points);
    const auto tracks = DecodePointTracks(*chunk.tracks);
    EXPECT_TRUE(decoded.ok() && tracks.ok());
    EXPECT_EQ(decoded->version, chunk.version);
    EXPECT_EQ(decoded->points.size(), chunk.num_points);
    for (size_t i = 0; i < decoded->points.size(); ++i) {
      const ShapePoint& point = decoded->points[i];
      Shown shown{{}, point.rgb[0], point.num_photos, decoded->step};
      for (int k = 0; k < 3; ++k) shown.xyz[k] = decoded->origin[k] + decoded->step * point.xyz[k];
      points[tracks->observations[tracks->ends[i] - 1].point2D_idx] = shown;
    }
  }
  return points;
}

std::map<uint64_t, uint64_t> VersionsOf(const MapShape& shape) {
  std::map<uint64_t, uint64_t> versions;
  for (const auto& [id, chunk] : shape.chunks) versions[id] = chunk.version;
  return versions;
}

TEST(ShapeMaker, PositionsAreRightToHalfAStep) {
  const ShapeSource source = Cube(1000);
  ShapeMaker maker(kChunkPoints);
  ASSERT_TRUE(maker.Update(source, 5));
  const auto points = PointsOf(maker.shape());
  ASSERT_EQ(points.size(), 1000u);
  EXPECT_EQ(maker.shape().NumPoints(), 1000);
  for (const auto& point : source.points) {
    const Shown& shown = points.at(point.id);
    EXPECT_LE(shown.step, 10.0 / 8192);
    for (int k = 0; k < 3; ++k)
      EXPECT_LE(std::abs(shown.xyz[k] - point.xyz[k]), shown.step * 0.5001);
    EXPECT_EQ(shown.grey, point.rgb[0]);
    EXPECT_EQ(shown.num_photos, 2 + point.id % 3);
  }
}

TEST(ShapeMaker, DistantPointsDoNotCoarsenTheRest) {
  ShapeSource source = Cube(1000);
  for (int i = 0; i < 1000; i += 100) source.points[i].xyz = {1e5 + i, -1e5, 3e4};
  ShapeMaker maker(kChunkPoints);
  maker.Update(source, 5);
  const auto points = PointsOf(maker.shape());
  ASSERT_EQ(points.size(), 1000u);
  for (const auto& point : source.points) {
    const Shown& shown = points.at(point.id);
    const bool is_far = point.xyz[0] > 100;
    if (!is_far) {
      EXPECT_LE(shown.step, 10.0 / 8192);
    }
    for (int k = 0; k < 3; ++k)
      EXPECT_LE(std::abs(shown.xyz[k] - point.xyz[k]), shown.step * 0.5001);
  }
}

TEST(ShapeMaker, TheOrderOfTheSourceMakesNoDifference) {
  const ShapeSource source = Cube(500);
  ShapeMaker one(kChunkPoints), other(kChunkPoints);
  one.Update(source, 5);
  other.Update(Shuffled(source), 5);
  ASSERT_EQ(VersionsOf(one.shape()), VersionsOf(other.shape()));
  for (const auto& [id, chunk] : one.shape().chunks) {
    EXPECT_EQ(*chunk.points, *other.shape().chunks.at(id).points);
    EXPECT_EQ(*chunk.tracks, *other.shape().chunks.at(id).tracks);
  }
}

// Kolmogorov-Smirnov distance of the ids in the first half from uniform, which a sample keeps low.
TEST(ShapeMaker, TheBeginningOfAChunkIsASampleOfIt) {
  const ShapeSource source = Cube(4000);
  ShapeMaker maker(4000);
  maker.Update(source, 5);
  const auto& chunk = maker.shape().chunks.begin()->second;
  ASSERT_EQ(chunk.num_points, 4000u);
  const auto tracks = DecodePointTracks(*chunk.tracks);
  std::vector<double> ids;
  for (int i = 0; i < 1000; ++i) {
    ids.push_back(tracks->observations[tracks->ends[i] - 1].point2D_idx / 4000.0);
  }
  std::sort(ids.begin(), ids.end());
  double distance = 0;
  for (int i = 0; i < 1000; ++i) distance = std::max(distance, std::abs(ids[i] - (i + 0.5) / 1000));
  EXPECT_LT(distance, 0.06) << "1.95 / sqrt(1000): 0.1 % of random orders are above";
}

TEST(ShapeMaker, NothingIsNewWhereNothingChanged) {
  ShapeSource source = Cube(1000);
  ShapeMaker maker(kChunkPoints);
  EXPECT_TRUE(maker.Update(source, 5));
  EXPECT_FALSE(maker.Update(source, 6));
  EXPECT_EQ(maker.shape().version, 5u);
  source.photos[0].tvec[0] = 1;
  EXPECT_TRUE(maker.Update(source, 7)) << "a pose";
  EXPECT_EQ(maker.shape().version, 7u);
  for (const auto& [id, version] : VersionsOf(maker.shape())) EXPECT_EQ(version, 5u);
}

TEST(ShapeMaker, VersionsRiseWhereAPointMovedByMoreThanAStep) {
  ShapeSource source = Cube(1000);
  ShapeMaker maker(kChunkPoints);
  maker.Update(source, 5);
  const double step = PointsOf(maker.shape()).at(250).step;
  source.points[249].xyz[1] += 0.99 * step;
  EXPECT_FALSE(maker.Update(source, 6));
  source.points[249].xyz[1] += 0.99 * step;
  EXPECT_TRUE(maker.Update(source, 7)) << "small movements add up";
  int num_risen = 0;
  for (const auto& [id, version] : VersionsOf(maker.shape())) num_risen += version == 7 ? 1 : 0;
  EXPECT_EQ(num_risen, 1);
  EXPECT_NEAR(PointsOf(maker.shape()).at(250).xyz[1], source.points[249].xyz[1], step);
}

TEST(ShapeMaker, NewPointsFillTheLatestChunk) {
  const ShapeSource source = Cube(1000);
  ShapeMaker maker(kChunkPoints);
  maker.Update(Only(source, [](const auto& point) { return point.id <= 950; }), 5);
  const auto before = VersionsOf(maker.shape());
  maker.Update(source, 6);
  const auto after = VersionsOf(maker.shape());
  EXPECT_EQ(after.size(), before.size());
  int num_risen = 0;
  for (const auto& [id, version] : after) num_risen += version == 6 ? 1 : 0;
  EXPECT_EQ(num_risen, 1);
  EXPECT_EQ(PointsOf(maker.shape()).size(), 1000u);
}

TEST(ShapeMaker, ALongerTrackAloneIsNoChange) {
  const ShapeSource source = Cube(300);
  ShapeMaker maker(kChunkPoints);
  maker.Update(source, 5);
  ShapeSource longer = source;
  longer.tracks.observations.push_back({9, 300});
  ++longer.tracks.ends.back();
  EXPECT_FALSE(maker.Update(longer, 6));
}

TEST(ShapeMaker, PointsThatGoLeaveAndSmallChunksAreDissolved) {
  const ShapeSource source = Cube(1000);
  ShapeMaker maker(kChunkPoints);
  maker.Update(source, 5);
  const size_t num_chunks = maker.shape().chunks.size();
  // Of each hundred, five stay.
  const ShapeSource few = Only(source, [](const auto& point) { return point.id % 20 == 0; });
  ASSERT_TRUE(maker.Update(few, 6));
  const auto points = PointsOf(maker.shape());
  EXPECT_EQ(points.size(), few.points.size());
  for (const auto& point : few.points) {
    EXPECT_EQ(points.at(point.id).grey, point.rgb[0]) << "a point keeps its colour";
  }
  EXPECT_LT(maker.shape().chunks.size(), num_chunks / 2);
  EXPECT_FALSE(maker.Update(few, 7));
}

TEST(ShapeMaker, AnEmptyMapHasNoChunks) {
  ShapeMaker maker(kChunkPoints);
  EXPECT_FALSE(maker.Update({}, 5));
  maker.Update(Cube(300), 6);
  EXPECT_TRUE(maker.Update({}, 7));
  EXPECT_TRUE(maker.shape().chunks.empty());
  EXPECT_FALSE(maker.Update({}, 8));
}

TEST(ShapeMaker, AMapThatGrowsKeepsItsErrorsBelowHalfAStep) {
  ShapeMaker maker(kChunkPoints);
  for (const double side : {0.1, 1.0, 10.0, 1000.0}) {
    const ShapeSource source = Cube(600, side, static_cast<unsigned>(side * 10));
    maker.Update(source, static_cast<int64_t>(side * 100));
    const auto points = PointsOf(maker.shape());
    ASSERT_EQ(points.size(), 600u);
    for (const auto& point : source.points) {
      const Shown& shown = points.at(point.id);
      EXPECT_LE(shown.step, side / 2048) << side;
      for (int k = 0; k < 3; ++k) {
        EXPECT_LE(std::abs(shown.xyz[k] - point.xyz[k]), shown.step * 0.5001) << side;
      }
    }
  }
}

TEST(ShapeMaker, NewPointsComeBesideTheLastCopyOfAll) {
  const ShapeSource all = Cube(1000);
  ShapeSource copied = Only(all, [](const auto& point) { return point.id <= 950; });
  ShapeSource news = Only(all, [](const auto& point) { return point.id > 950; });
  news.photos.push_back({2, 1, {1, 0, 0, 0}, {1, 0, 0}});
  ShapeMaker maker(kChunkPoints);
  maker.Update(copied, 5);
  const auto before = VersionsOf(maker.shape());
  EXPECT_TRUE(maker.UpdateWith(news, &copied, 6));
  EXPECT_EQ(PointsOf(maker.shape()).size(), 1000u);
  EXPECT_EQ(maker.shape().photos, news.photos);
  int num_risen = 0;
  for (const auto& [id, version] : VersionsOf(maker.shape())) num_risen += version == 6 ? 1 : 0;
  EXPECT_EQ(num_risen, 1) << "the chunk that takes new points";
  EXPECT_EQ(copied.points.size(), 950u);
  EXPECT_EQ(copied.tracks.ends.size(), 950u);
  EXPECT_EQ(copied.tracks.observations.size(), copied.tracks.ends.back());
  EXPECT_FALSE(maker.UpdateWith(news, &copied, 7)) << "the same once more";
  ShapeSource later = all;
  later.photos = news.photos;
  EXPECT_FALSE(maker.Update(later, 8)) << "a copy of all finds nothing else";
}

TEST(ShapeMaker, WhatIsNewIsWhatNewPhotosSee) {
  SyntheticOptions options;
  options.num_photos = 8;
  const SyntheticScene scene = MakeScene(options);
  SceneMap map;
  AddToMap(scene, scene.pairs, &map);
  RegisterAtTruth(scene, {1, 2, 3, 4, 5, 6}, Eigen::Vector3d::Zero(), &map);
  const ShapeSource before = CopyForShape(map, 0);
  RegisterAtTruth(scene, {7, 8}, Eigen::Vector3d::Zero(), &map);
  const ShapeSource after = CopyForShape(map, 0);
  ASSERT_GT(after.points.size(), before.points.size()) << "two photos alone see some";
  const ShapeSource news = CopyNewForShape(map, {1, 2, 3, 4, 5, 6}, before.MaxId());
  EXPECT_EQ(news.points.size(), after.points.size() - before.points.size());
  EXPECT_EQ(news.tracks.ends.size(), news.points.size());
  EXPECT_EQ(news.photos, after.photos);
  for (const auto& point : news.points) EXPECT_GT(point.id, before.MaxId());
  EXPECT_TRUE(CopyNewForShape(map, {1, 2, 3, 4, 5, 6, 7, 8}, before.MaxId()).points.empty());
}

TEST(ShapeMaker, VersionsNeverFall) {
  ShapeSource source = Cube(300);
  ShapeMaker maker(kChunkPoints);
  maker.Update(source, 100);
  source.points[0].xyz[0] += 1;
  maker.Update(source, 50);  // a clock that was set back
  EXPECT_EQ(maker.shape().version, 101u);
}

TEST(ShapeMaker, AThousandMovesLeaveWhatOneUpdateWouldMake) {
  std::mt19937 random(3);
  ShapeSource source = Cube(800);
  ShapeMaker maker(kChunkPoints);
  std::set<uint64_t> gone;
  for (int round = 0; round < 200; ++round) {
    for (int i = 0; i < 5; ++i) {
      auto& point = source.points[random() % 800];
      point.xyz[random() % 3] += 1e-3 * static_cast<double>(random() % 100);
    }
    gone.insert(random() % 800 + 1);
    if (round % 3 == 0) gone.erase(gone.begin());
    const ShapeSource now =
        Only(source, [&gone](const auto& point) { return gone.count(point.id) == 0; });
    maker.Update(now, round + 1);
    const auto points = PointsOf(maker.shape());
    ASSERT_EQ(points.size(), now.points.size());
    for (const auto& point : now.points) {
      const Shown& shown = points.at(point.id);
      for (int k = 0; k < 3; ++k) {
        ASSERT_LE(std::abs(shown.xyz[k] - point.xyz[k]), 1.501 * shown.step) << round;
      }
    }
  }
}

}  // namespace skein::shape_maker_test
