// Compares a place that follows its map with one made afresh of the same map.
#include "guidance/live_place.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <tuple>
#include <vector>

#include "testing/test_poses.h"

namespace skein::live_place_test {

using Positions = std::vector<Eigen::Vector3d>;

// Points on a corner of a house, on a pillar before it, and in the air; photos see what they look
// at from the front, and nothing through the pillar's width. Points keep their index.
class GrowingMap {
 public:
  GrowingMap() {
    map_.cameras = {{1200, 900, 1000, 1000, 600, 450}};
    AddWall({0, 0, 4}, {12, 0, 0}, {0, 0, -4}, 4000);
    AddWall({12, 0, 4}, {0, 8, 0}, {0, 0, -4}, 2500);
    AddWall({5, -3, 4}, {1, 0, 0}, {0, 0, -4}, 900);
    for (int i = 0; i < 60; ++i) Add({12 * Unit(), -4 * Unit(), 4 * Unit()}, {0, -1, 0});
  }

  GuidedMap& map() { return map_; }
  // Points that one photo sees are none.
  GuidedMap Now() const {
    GuidedMap now = map_;
    for (GuidedPoint& point : now.points) {
      if (point.photos.size() < 2) point.photos.clear();
    }
    return now;
  }

  void Photograph(const Eigen::Vector3d& centre, const Eigen::Vector3d& target) {
    const auto photo = static_cast<uint32_t>(map_.photos.size());
    const CameraPose pose = LookingAt(centre, target);
    map_.photos.push_back({photo + 1, 0, 0, pose});
    if (photo % 3 == 0) {
      map_.photos.back().texture.emplace();
      map_.photos.back().texture->bits.fill(photo % 2 == 0 ? 0xff : 0xf0);
    }
    for (size_t i = 0; i < map_.points.size(); ++i) {
      Eigen::Vector2d pixel;
      const Eigen::Vector3d ray = centre - map_.points[i].xyz;
      if (ray.dot(normals_[i]) < 0.25 * ray.norm() || Unit() < 0.3) continue;
      if (map_.cameras[0].Project(pose.Apply(map_.points[i].xyz), &pixel)) {
        map_.points[i].photos.push_back(photo);
      }
    }
  }
  // The i-th photo of a walk around the corner.
  void PhotographNext() {
    const double t = 0.7 * static_cast<double>(map_.photos.size());
    if (t < 11) return Photograph({t, -7, 2}, {t, 0, 2});
    Photograph({18, t - 13, 2}, {12, t - 11, 2});
  }
  void MovePoints(double by, int every) {
    for (size_t i = 0; i < map_.points.size(); i += static_cast<size_t>(every)) {
      map_.points[i].xyz += by * Eigen::Vector3d(Unit() - 0.5, Unit() - 0.5, Unit() - 0.5);
    }
  }
  void DropPoints(int every) {
    for (size_t i = 0; i < map_.points.size(); i += static_cast<size_t>(every)) {
      map_.points[i].photos.clear();
    }
  }
  void Scale(double by) {
    for (GuidedPoint& point : map_.points) point.xyz *= by;
    for (GuidedPhoto& photo : map_.photos) photo.cam_from_world.translation *= by;
  }
  void WithdrawPhoto(uint32_t photo) {
    map_.photos.erase(map_.photos.begin() + photo);
    for (GuidedPoint& point : map_.points) {
      std::vector<uint32_t> left;
      for (const uint32_t other : point.photos) {
        if (other != photo) left.push_back(other - (other > photo ? 1 : 0));
      }
      point.photos = left;
    }
  }

 private:
  double Unit() { return std::uniform_real_distribution<double>(0, 1)(random_); }
  void Add(const Eigen::Vector3d& xyz, const Eigen::Vector3d& normal) {
    map_.points.push_back({xyz, {}});
    normals_.push_back(normal);
  }
  void AddWall(const Eigen::Vector3d& corner, const Eigen::Vector3d& right,
               const Eigen::Vector3d& down, int count) {
    for (int i = 0; i < count; ++i) {
      Add(corner + Unit() * right + Unit() * down, down.cross(right).normalized());
    }
  }

  std::mt19937 random_{11};
  GuidedMap map_;
  std::vector<Eigen::Vector3d> normals_;
};

// Surfels and pieces in the order of where they are.
template <class T, class SurfelOf>
std::vector<const T*> ByPosition(const std::vector<T>& all, const SurfelOf& surfel_of) {
  std::vector<const T*> living;
  for (const T& one : all) {
    if (!surfel_of(one).IsGone()) living.push_back(&one);
  }
  std::sort(living.begin(), living.end(), [&](const T* a, const T* b) {
    const Eigen::Vector3d &p = surfel_of(*a).position, &q = surfel_of(*b).position;
    return std::tie(p.x(), p.y(), p.z()) < std::tie(q.x(), q.y(), q.z());
  });
  return living;
}

void ExpectSame(const Surfel& a, const Surfel& b) {
  EXPECT_LT((a.position - b.position).norm(), 1e-9);
  EXPECT_LT((a.normal - b.normal).norm(), 1e-6);
  EXPECT_NEAR(a.area, b.area, 1e-6);
  EXPECT_EQ(a.num_points, b.num_points);
  EXPECT_EQ(a.photos, b.photos);
  EXPECT_EQ(a.at_end, b.at_end);
  EXPECT_EQ(a.open_border, b.open_border);
  EXPECT_EQ(a.is_ground, b.is_ground);
  EXPECT_LT((a.beyond - b.beyond).norm(), 1e-5);
  EXPECT_LT((a.beyond_normal - b.beyond_normal).norm(), 1e-5);
  EXPECT_EQ(a.beyond_max_deg, b.beyond_max_deg);
}

void ExpectSame(const SurfelQuality& a, const SurfelQuality& b) {
  EXPECT_EQ(a.num_photos, b.num_photos);
  EXPECT_NEAR(a.best_gsd, b.best_gsd, 1e-9);
  EXPECT_NEAR(a.reconstructability, b.reconstructability, 1e-5);
  EXPECT_EQ(std::isinf(a.sigma), std::isinf(b.sigma));
  EXPECT_EQ(a.textured_share, b.textured_share);
  EXPECT_EQ(a.counts, b.counts);
  EXPECT_EQ(a.good, b.good);
}

void ExpectSame(const PlaceQuality& live, const PlaceQuality& anew) {
  EXPECT_NEAR(live.surface.cell, anew.surface.cell, 1e-12);
  EXPECT_NEAR(live.surface.working_distance, anew.surface.working_distance, 1e-12);
  const auto itself = [](const Surfel& surfel) -> const Surfel& { return surfel; };
  const auto surfels = ByPosition(live.surface.surfels, itself);
  const auto surfels_anew = ByPosition(anew.surface.surfels, itself);
  ASSERT_EQ(surfels.size(), surfels_anew.size());
  ASSERT_EQ(live.surfels.size(), live.surface.surfels.size());
  const std::vector<double> good = GoodSharesOf(live), good_anew = GoodSharesOf(anew);
  ASSERT_EQ(good.size(), live.surface.surfels.size());
  for (size_t i = 0; i < surfels.size(); ++i) {
    SCOPED_TRACE(surfels_anew[i]->position.transpose());
    ExpectSame(*surfels[i], *surfels_anew[i]);
    const auto index = static_cast<size_t>(surfels[i] - live.surface.surfels.data());
    const auto index_anew = static_cast<size_t>(surfels_anew[i] - anew.surface.surfels.data());
    ExpectSame(live.surfels[index], anew.surfels[index_anew]);
    EXPECT_NEAR(good[index], good_anew[index_anew], 1e-6);
    if (testing::Test::HasFailure()) return;
  }
  const auto surfel_of = [](const Piece& piece) -> const Surfel& { return piece.surfel; };
  const auto pieces = ByPosition(live.pieces, surfel_of);
  const auto pieces_anew = ByPosition(anew.pieces, surfel_of);
  ASSERT_EQ(pieces.size(), pieces_anew.size());
  for (size_t i = 0; i < pieces.size(); ++i) {
    EXPECT_EQ(pieces[i]->surfel.photos, pieces_anew[i]->surfel.photos);
    EXPECT_NEAR(pieces[i]->width, pieces_anew[i]->width, 1e-12);
    EXPECT_LT((live.surface.surfels[pieces[i]->whole].position -
               anew.surface.surfels[pieces_anew[i]->whole].position)
                  .norm(),
              1e-9);
    ExpectSame(pieces[i]->quality, pieces_anew[i]->quality);
    if (testing::Test::HasFailure()) return;
  }
  EXPECT_NEAR(live.completeness.area, anew.completeness.area, 1e-5);
  EXPECT_NEAR(live.completeness.good_share, anew.completeness.good_share, 1e-6);
  EXPECT_NEAR(live.completeness.open_share, anew.completeness.open_share, 1e-9);
  EXPECT_NEAR(live.completeness.hole_share, anew.completeness.hole_share, 1e-9);
  EXPECT_NEAR(live.completeness.target_gsd, anew.completeness.target_gsd, 1e-12);
  EXPECT_EQ(live.completeness.complete, anew.completeness.complete);
}

// Lengths are given: as they change with every photo, all would be recomputed.
const Holding kNothingHeld{0, PlaceScale{0.007, 8, 0.35, 0.15}};

void ExpectSameAnew(LivePlace* live, const GuidedMap& map) {
  LivePlace anew(kNothingHeld);
  ExpectSame(live->Update(map, 0), anew.Update(map, 0));
}

TEST(LivePlace, WithoutToleranceSaysWhatIsSaidOfTheMapAnew) {
  GrowingMap growing;
  LivePlace live(kNothingHeld);
  const auto check = [&](const char* what) {
    SCOPED_TRACE(what);
    ExpectSameAnew(&live, growing.Now());
    return !testing::Test::HasFailure();
  };
  for (int i = 0; i < 26; ++i) {
    growing.PhotographNext();
    ASSERT_TRUE(check("another photo")) << i;
  }
  ASSERT_GT(live.place().surface.surfels.size(), 200u);
  EXPECT_GT(live.place().completeness.good_share, 0.1);
  growing.MovePoints(0.2, 40);
  ASSERT_TRUE(check("points moved"));
  growing.map().photos[3].cam_from_world.translation.x() += 0.1;
  ASSERT_TRUE(check("a photo moved"));
  growing.DropPoints(9);
  ASSERT_TRUE(check("points went"));
  growing.map().photos[4].texture.emplace();
  ASSERT_TRUE(check("another texture"));
  growing.map().cameras[0].fx_px += 20;
  ASSERT_TRUE(check("another camera"));
  growing.map().points.resize(growing.map().points.size() - 50);
  ASSERT_TRUE(check("fewer points than before"));
  growing.WithdrawPhoto(5);
  ASSERT_TRUE(check("a photo went"));
  growing.PhotographNext();
  ASSERT_TRUE(check("another one came"));
}

// What comes between photos and a wall hides parts of surfels whose middle is in view as before. It
// is observed by photos that look away from the wall.
TEST(LivePlace, WhatComesBetweenHidesPartsOfSurfels) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> unit(0, 1);
  GuidedMap map;
  map.cameras = {{1200, 900, 1000, 1000, 600, 450}};
  for (uint32_t i = 0; i < 8; ++i) {
    map.photos.push_back({i + 1, 0, 0, LookingAt({3.0 + 0.6 * i, -7, 2}, {3.0 + 0.6 * i, 0, 2})});
  }
  for (int i = 0; i < 6000; ++i) {
    const auto first = static_cast<uint32_t>(7 * unit(random));
    map.points.push_back({{1 + 9 * unit(random), 0, 4 * unit(random)}, {first, first + 1}});
  }
  LivePlace live(kNothingHeld);
  ExpectSameAnew(&live, map);
  const auto count_views = [&] {
    size_t count = 0;
    for (const Piece& piece : live.place().pieces) count += piece.surfel.photos.size();
    return count;
  };
  const size_t before = count_views();
  map.photos.push_back({9, 0, 0, LookingAt({5.3, -1, 2}, {5.3, -4, 2})});
  map.photos.push_back({10, 0, 0, LookingAt({5.7, -1, 2}, {5.7, -4, 2})});
  for (int i = 0; i < 900; ++i) {
    map.points.push_back({{5 + unit(random), -4, 1 + 2 * unit(random)}, {8, 9}});
  }
  ExpectSameAnew(&live, map);
  EXPECT_LT(count_views(), before) << "though there are more pieces now";
}

// Points of a part on both sides of its middle, in whose larger cell there is none at first.
TEST(LivePlace, APartAppearsWithItsSurfel) {
  GuidedMap map;
  map.cameras = {{1200, 900, 1000, 1000, 600, 450}};
  for (uint32_t i = 0; i < 3; ++i) {
    map.photos.push_back({i + 1, 0, 0, LookingAt({0.3 * i, 0.4, 8}, {0.4, 0.4 + 0.01 * i, 0})});
  }
  for (const double by : {0.0, 0.004, 0.008}) {
    map.points.push_back({{0.31 + by, 0.44 - by, 0.01}, {0, 1, 2}});
    map.points.push_back({{0.44 - by, 0.31 + by, 0.01 + by}, {0, 1, 2}});
  }
  LivePlace live(kNothingHeld);
  ExpectSameAnew(&live, map);
  const auto num_parts = [&] {
    return std::count_if(live.place().pieces.begin(), live.place().pieces.end(),
                         [](const Piece& piece) { return piece.width == 0.15; });
  };
  EXPECT_EQ(num_parts(), 0);
  map.points.push_back({{0.65, 0.65, 0.01}, {0, 1, 2}});
  ExpectSameAnew(&live, map);
  EXPECT_EQ(num_parts(), 1);
}

TEST(LivePlace, WhereTheScaleStaysOnlyChangesAreMadeAnew) {
  GrowingMap growing;
  for (int i = 0; i < 20; ++i) growing.PhotographNext();
  LivePlace live({1e-9});
  GuidedMap now = growing.Now();
  live.Update(now, 0);
  // Points that trade places: no median changes, and many cells do.
  int traded = 0;
  for (size_t i = 0; i + 1 < now.points.size() && traded < 300; i += 7) {
    if (now.points[i].photos.size() < 2 || now.points[i + 1].photos.size() < 2) continue;
    std::swap(now.points[i].xyz, now.points[i + 1].xyz);
    std::swap(now.points[i].photos, now.points[i + 1].photos);
    ++traded;
  }
  ASSERT_EQ(traded, 300);
  const std::vector<Surfel> before = live.place().surface.surfels;
  ExpectSame(live.Update(now, 0), AssessPlace(now));
  ASSERT_EQ(live.place().surface.surfels.size(), before.size());
  for (size_t i = 0; i < before.size(); ++i) {
    EXPECT_LT((live.place().surface.surfels[i].position - before[i].position).norm(), 1e-9)
        << "keeps its index";
  }
}

TEST(LivePlace, WhatMovesWithinTheToleranceIsHeld) {
  GrowingMap growing;
  for (int i = 0; i < 20; ++i) growing.PhotographNext();
  LivePlace live;
  live.Update(growing.Now(), 0);
  const Positions before = [&] {
    Positions positions;
    for (const Surfel& surfel : live.place().surface.surfels) positions.push_back(surfel.position);
    return positions;
  }();
  const Completeness said = live.place().completeness;
  growing.MovePoints(1e-4, 1);
  growing.map().photos[3].cam_from_world.translation.x() += 1e-3;
  live.Update(growing.Now(), 0);
  ASSERT_EQ(live.place().surface.surfels.size(), before.size());
  for (size_t i = 0; i < before.size(); ++i) {
    EXPECT_EQ(live.place().surface.surfels[i].position, before[i]);
  }
  EXPECT_EQ(live.place().completeness.good_share, said.good_share);
}

// Photos, small moves and the scale's changes, with the tolerance that the guide has.
TEST(LivePlace, WithToleranceSaysNearlyTheSame) {
  GrowingMap growing;
  LivePlace live;
  for (int i = 0; i < 32; ++i) {
    growing.PhotographNext();
    if (i == 20) growing.Scale(3);
    growing.MovePoints(0.01, 3);
    if (i > 2) growing.map().photos[i - 2].cam_from_world.translation.x() += 0.01;
    const GuidedMap now = growing.Now();
    const Completeness& said = live.Update(now, 0).completeness;
    const Completeness anew = AssessPlace(now).completeness;
    EXPECT_NEAR(said.good_share, anew.good_share, 0.06) << i;
    EXPECT_NEAR(said.hole_share, anew.hole_share, 0.03) << i;
    EXPECT_NEAR(said.area, anew.area, 0.1 * anew.area) << i;
    EXPECT_NEAR(said.target_gsd, anew.target_gsd, 0.11 * anew.target_gsd) << i;
  }
}

}  // namespace skein::live_place_test
