// Guidance on walls of which everything is known. World: metres, z up.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "guidance/holes.h"
#include "guidance/quality.h"
#include "guidance/stations.h"
#include "guidance/surface.h"
#include "testing/test_site.h"

namespace skein::guidance_test {

TEST(Guidance, SurfelsLieOnTheSurfaceAndFaceThePhotos) {
  const GuidedMap map = SiteOfARow(FrontWall(-4, 8), -2, 2).Map();
  const Surface surface = MakeSurface(map).surface;
  ASSERT_GT(surface.surfels.size(), 100u);
  double area = 0;
  for (const Surfel& surfel : surface.surfels) {
    EXPECT_NEAR(surfel.position.y(), 0, 1e-9);
    EXPECT_GT(surfel.normal.dot(Eigen::Vector3d(0, -1, 0)), 0.99);
    area += surfel.area;
  }
  EXPECT_NEAR(area, 8 * 4, 0.25 * 8 * 4);
  EXPECT_NEAR(surface.working_distance, 8.2, 0.5);
  EXPECT_NEAR(surface.median_gsd, 0.008, 0.0005);
}

TEST(Guidance, APhotoWithoutAnObservationSeesASurfelUnlessItIsHidden) {
  Site site({FrontWall(-4, 8), FrontWall(-1, 2, 4, -4)});  // the second one stands in front
  for (const double x : {-6.0, -5.0, 5.0, 6.0}) site.Photograph({x, -8, 2}, {0, -2, 2});
  for (const double x : {-6.0, -5.0, 5.0, 6.0}) site.Photograph({x, -8, 2}, {0.5 * x, 0, 2});
  GuidedMap map = site.Map();
  const auto last = static_cast<uint32_t>(map.photos.size());
  map.photos.push_back({100, 0, 0, LookingAt({0, -12, 2}, {0, 0, 2})});
  int num_seen = 0, num_hidden = 0;
  for (const Surfel& surfel : MakeSurface(map).surface.surfels) {
    if (std::abs(surfel.position.z() - 2) > 1) continue;
    const bool seen = std::count(surfel.photos.begin(), surfel.photos.end(), last) > 0;
    const bool behind = surfel.position.y() > -0.1 && std::abs(surfel.position.x()) < 0.7;
    const bool free = surfel.position.y() < -3.9 || std::abs(surfel.position.x()) > 2.5;
    if (behind) {
      ++num_hidden;
      EXPECT_FALSE(seen) << surfel.position.transpose();
    }
    if (free) {
      ++num_seen;
      EXPECT_TRUE(seen) << surfel.position.transpose();
    }
  }
  EXPECT_GT(num_seen, 10);
  EXPECT_GT(num_hidden, 3);
}

TEST(Guidance, ABorderIsOpenWhereNobodyLookedAndClosedWhereNothingIs) {
  // 3 m of a wall of 20 m are in frame; then all of it, and 2 m of nothing around it; then from its
  // sides, too.
  enum class Shown { kPart, kFront, kSides };
  for (const Shown shown : {Shown::kPart, Shown::kFront, Shown::kSides}) {
    const double wall_width = shown == Shown::kPart ? 20 : 3;
    Site site({FrontWall(-wall_width / 2, wall_width, 3)});
    for (const double x : {-1.0, -0.5, 0.0, 0.5, 1.0}) site.Photograph({x, -6, 1.5}, {x, 0, 1.5});
    if (shown == Shown::kSides) {
      for (const double x : {-7.0, -6.5, 6.5, 7.0}) site.Photograph({x, -3, 1.5}, {0, 0, 1.5});
    }
    const Surface surface = MakeSurface(site.Map()).surface;
    int at_sides = 0, open_at_sides = 0, open_elsewhere = 0;
    double outermost = 0;
    for (const Surfel& s : surface.surfels)
      outermost = std::max(outermost, std::abs(s.position.x()));
    for (const Surfel& surfel : surface.surfels) {
      const bool at_side = std::abs(surfel.position.x()) > outermost - surface.cell;
      at_sides += at_side;
      (at_side ? open_at_sides : open_elsewhere) += surfel.open_border;
    }
    ASSERT_GT(at_sides, 5);
    EXPECT_LE(open_elsewhere, 2);
    if (shown == Shown::kSides) {
      EXPECT_EQ(open_at_sides, 0);
    } else {
      EXPECT_GT(open_at_sides, 0.5 * at_sides) << at_sides;
    }
  }
}

// Photos of a house's back have the place behind its front wall in their frame, too.
TEST(Guidance, OnlyWhoStandsAtTheSideSeesAroundACorner) {
  Site site({FrontWall(-2, 4, 3)});
  for (const double x : {-1.0, -0.5, 0.0, 0.5, 1.0}) site.Photograph({x, -8, 1.5}, {x, 0, 1.5});
  for (const double x : {-0.5, 0.0, 0.5}) site.Photograph({x, 8, 1.5}, {x, 0, 1.5});
  const Surface surface = MakeSurface(site.Map()).surface;
  int at_sides = 0, open = 0;
  for (const Surfel& surfel : surface.surfels) {
    if (std::abs(surfel.position.x()) < 2 - surface.cell) continue;
    ++at_sides;
    open += surfel.open_border;
  }
  ASSERT_GT(at_sides, 5);
  EXPECT_GT(open, 4);
}

TEST(Guidance, SigmaOfTwoPhotosIsThatOfTriangulation) {
  // Both a degrees from the normal: the depth's variance is gsd^2 / (2 sin^2 a).
  const Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();
  const double a = 10 * kDegree;
  const std::vector<ViewOfSurfel> views = {{{std::sin(a), 0, std::cos(a)}, 0.01},
                                           {{-std::sin(a), 0, std::cos(a)}, 0.01}};
  const SurfelQuality quality = AssessSurfel(0.01, normal, views);
  EXPECT_NEAR(quality.sigma, 0.01 / (std::sqrt(2.0) * std::sin(a)), 1e-9);
  EXPECT_DOUBLE_EQ(quality.best_gsd, 0.01);
  EXPECT_FALSE(quality.good) << "two photos";
}

TEST(Guidance, WhatMakesASurfelGood) {
  const Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();
  const auto views = [](std::vector<double> angles_deg, double gsd) {
    std::vector<ViewOfSurfel> result;
    for (const double angle : angles_deg) {
      result.push_back({{std::sin(angle * kDegree), 0, std::cos(angle * kDegree)}, gsd});
    }
    return result;
  };
  const auto is_good = [&](const std::vector<double>& angles_deg, double gsd) {
    return AssessSurfel(0.01, normal, views(angles_deg, gsd)).good;
  };
  EXPECT_TRUE(is_good({-20, 0, 20}, 0.01));
  EXPECT_FALSE(is_good({-20, 20}, 0.01)) << "two photos";
  EXPECT_FALSE(is_good({-1, 0, 1}, 0.01)) << "no parallax";
  EXPECT_FALSE(is_good({-70, 0, 70}, 0.01)) << "too different to match";
  EXPECT_FALSE(is_good({55, 65, 75}, 0.01)) << "too slanted";
  EXPECT_FALSE(is_good({-20, 0, 20}, 0.05)) << "too far";
  EXPECT_FALSE(is_good({-40, -20, 0, 20, 40}, 0.012)) << "not the resolution that is wanted";
}

TEST(Guidance, AFewPhotosOfTheWholeWallMakeItComplete) {
  Site site({FrontWall(-4, 8)});
  for (const double x : {-4.0, -2.0, 0.0, 2.0, 4.0}) site.Photograph({x, -8, 2}, {0.6 * x, 0, 2});
  for (const double x : {-11.0, -10.0, 10.0, 11.0}) site.Photograph({x, -5, 2}, {0, 0, 2});
  const PlaceQuality place = Assess(site.Map());
  EXPECT_GT(place.completeness.good_share, 0.95);
  EXPECT_LT(place.completeness.open_share, 0.05);
  EXPECT_TRUE(place.completeness.complete);
}

// A house across the square is in all photos of a wall. It was not meant.
TEST(Guidance, WhatStandsInTheBackgroundDoesNotCount) {
  Wall house = FrontWall(-20, 40, 12, 34);
  house.density = 0.05;
  Site site({FrontWall(-4, 8), house});
  for (const double x : {-4.0, -2.0, 0.0, 2.0, 4.0}) site.Photograph({x, -8, 2}, {0.6 * x, 0, 2});
  for (const double x : {-11.0, -10.0, 10.0, 11.0}) site.Photograph({x, -5, 2}, {0, 0, 2});
  const GuidedMap map = site.Map();
  const PlaceQuality place = Assess(map);
  ASSERT_TRUE(std::any_of(place.surface.surfels.begin(), place.surface.surfels.end(),
                          [](const Surfel& surfel) { return surfel.position.y() > 33; }));
  EXPECT_NEAR(place.completeness.area, 8 * 4, 0.3 * 8 * 4);
  EXPECT_TRUE(place.completeness.complete);
  // Who wants the wall finer than it was photographed is told so.
  const Completeness too_coarse =
      AssessPlace(map, 0.3 * place.completeness.target_gsd).completeness;
  EXPECT_NEAR(too_coarse.area, place.completeness.area, 1e-9);
  EXPECT_LT(too_coarse.good_share, 0.05);
}

// A wall with points all around a bare part of it. Photos from the front; nothing is to be seen
// above and beside the wall.
TEST(Guidance, WhatHasNoPointsAmidWhatHasThemKeepsAPlaceFromBeingComplete) {
  const auto assess = [](double bare_height) {
    const double rest = 0.5 * (4 - bare_height);
    Site site({{{-4, 0, 4}, {8, 0, 0}, {0, 0, -rest}},
               {{-4, 0, rest}, {8, 0, 0}, {0, 0, -rest}},
               {{-4, 0, 4}, {1, 0, 0}, {0, 0, -4}},
               {{3, 0, 4}, {1, 0, 0}, {0, 0, -4}}});
    for (const double x : {-4.0, -2.0, 0.0, 2.0, 4.0}) site.Photograph({x, -8, 2}, {0.6 * x, 0, 2});
    for (const double x : {-11.0, -10.0, 10.0, 11.0}) site.Photograph({x, -5, 2}, {0, 0, 2});
    return Assess(site.Map()).completeness;
  };
  const Completeness whole = assess(0), bare = assess(3);
  EXPECT_LT(whole.hole_share, 0.01);
  EXPECT_TRUE(whole.complete);
  EXPECT_GT(bare.good_share, 0.9);
  EXPECT_GT(bare.hole_share, 0.15);
  EXPECT_FALSE(bare.complete);
}

// Panels 0.4 m wide, turned by 60 degrees to either side of the wall that they look like from afar.
std::vector<Wall> FoldingScreen() {
  std::vector<Wall> panels;
  for (int i = 0; i < 20; ++i) {
    const double depth = 0.4 * std::sin(60 * kDegree), back = i % 2 == 0 ? 0 : -depth;
    panels.push_back({{-2 + 0.2 * i, back, 3}, {0.2, i % 2 == 0 ? -depth : depth, 0}, {0, 0, -2}});
  }
  return panels;
}

TEST(Guidance, ASurfelIsAsGoodAsWhatIsInIt) {
  Site site(FoldingScreen(), 600);
  for (const double x : {-2.0, -1.0, 0.0, 1.0, 2.0}) site.Photograph({x, -8, 2}, {x, 0, 2});
  const PlaceQuality from_front = Assess(site.Map());
  int whole = 0, own_normal = 0;
  for (const SurfelQuality& quality : from_front.surfels) whole += quality.good;
  EXPECT_GT(whole, 0.8 * static_cast<double>(from_front.surfels.size())) << "the panels' mean";
  for (const Piece& piece : from_front.pieces) {
    if (piece.width > 0.5 * from_front.surface.cell) continue;  // of few points, at the ends
    if (std::abs(std::abs(piece.surfel.normal.x()) - std::sin(60 * kDegree)) > 0.05) continue;
    ++own_normal;
    EXPECT_FALSE(piece.quality.good) << "too slanted";
  }
  EXPECT_GT(own_normal, 100) << "away from the folds";
  EXPECT_LT(from_front.completeness.good_share, 0.6);
  for (const double side : {-1.0, 1.0}) {
    for (const double y : {-3.0, -4.0, -5.0, -6.0}) {
      site.Photograph({side * 8, y, 2}, {0, 0, 2});
    }
  }
  EXPECT_GT(Assess(site.Map()).completeness.good_share, 0.9);
}

// Few points: a surfel has no parts of its own.
// There is surface between the points, too.
TEST(Guidance, PiecesShareTheAreaOfTheirSurfel) {
  const PlaceQuality place = Assess(SiteOfARow(FrontWall(-4, 8), -2, 2).Map());
  std::vector<double> areas(place.surfels.size(), 0), good = areas;
  for (const Piece& piece : place.pieces) {
    areas[piece.whole] += piece.area;
    if (piece.quality.good) good[piece.whole] += piece.area;
  }
  ASSERT_GT(place.pieces.size(), place.surfels.size());
  const std::vector<double> good_shares = GoodSharesOf(place);
  for (size_t i = 0; i < areas.size(); ++i) {
    EXPECT_NEAR(areas[i], place.surface.surfels[i].area, 1e-9);
    EXPECT_NEAR(good[i], good_shares[i] * areas[i], 1e-9);
  }
}

TEST(Guidance, WherePointsAreFewASurfelIsJudgedAsAWhole) {
  const PlaceQuality place = Assess(SiteOfARow(FrontWall(-4, 8), -2, 2).Map());
  std::vector<int> pieces(place.surfels.size(), 0), wholes(place.surfels.size(), 0);
  for (const Piece& piece : place.pieces) {
    ++pieces[piece.whole];
    wholes[piece.whole] += piece.width == place.surface.cell;
  }
  const std::vector<double> good_shares = GoodSharesOf(place);
  for (size_t i = 0; i < pieces.size(); ++i) {
    EXPECT_GT(pieces[i], 0) << "of surfel " << i;
    if (wholes[i] > 0) {
      EXPECT_EQ(pieces[i], 1);
      EXPECT_EQ(good_shares[i], place.surfels[i].good ? 1 : 0);
    }
  }
}

// Points stand on the whole wall; the photos show texture on its left half alone.
GuidedMap HalfBare(GuidedMap map) {
  for (GuidedPhoto& photo : map.photos) {
    photo.texture.emplace();
    for (int row = 0; row < TextureFields::kRows; ++row) {
      for (int column = 0; column < TextureFields::kColumns; ++column) {
        const GuidedCamera& camera = map.cameras[photo.camera];
        const Eigen::Vector3d in_camera(
            ((column + 0.5) * camera.width_px / TextureFields::kColumns - camera.cx_px) /
                camera.fx_px,
            ((row + 0.5) * camera.height_px / TextureFields::kRows - camera.cy_px) / camera.fy_px,
            1);
        const Eigen::Vector3d ray = photo.cam_from_world.rotation.conjugate() * in_camera;
        const Eigen::Vector3d centre = photo.cam_from_world.Centre();
        if ((centre - centre.y() / ray.y() * ray).x() < 0) photo.texture->Set(column, row);
      }
    }
  }
  return map;
}

TEST(Guidance, WhatNoPhotoShowsTextureOnIsNotGood) {
  Site site({FrontWall(-4, 8)});
  for (const double x : {-4.0, -2.0, 0.0, 2.0, 4.0}) site.Photograph({x, -8, 2}, {0.6 * x, 0, 2});
  for (const double x : {-11.0, -10.0, 10.0, 11.0}) site.Photograph({x, -5, 2}, {0, 0, 2});
  const GuidedMap map = HalfBare(site.Map());
  const PlaceQuality place = Assess(map);
  ASSERT_TRUE(Assess(site.Map()).completeness.complete) << "where the texture is not known";
  EXPECT_FALSE(place.completeness.complete);
  EXPECT_NEAR(place.completeness.good_share, 0.5, 0.1);
  EXPECT_NEAR(place.completeness.area, Assess(site.Map()).completeness.area, 1e-9);
  const double cell = place.surface.cell;
  for (size_t i = 0; i < place.surfels.size(); ++i) {
    const double x = place.surface.surfels[i].position.x();
    if (std::abs(x) < cell) continue;
    EXPECT_EQ(place.surfels[i].textured_share, x < 0 ? 1 : 0) << x;
  }
  EXPECT_TRUE(ChooseStations(map, place, {SeekerAt(map)})[0].empty()) << "no photo makes it better";
}

TEST(Guidance, TextureCountsWhereThreePhotosShowIt) {
  Site site = SiteOfARow(FrontWall(-4, 8), -2, 2);
  GuidedMap map = site.Map();
  const auto num_good = [&] {
    const PlaceQuality place = Assess(map);
    return std::count_if(place.surfels.begin(), place.surfels.end(),
                         [](const SurfelQuality& quality) { return quality.good; });
  };
  const auto all_good = num_good();
  ASSERT_GT(all_good, 20);
  for (size_t i = 0; i < 2; ++i) map.photos[i].texture.emplace();
  EXPECT_GT(num_good(), 0) << "three others show it";
  for (GuidedPhoto& photo : map.photos) photo.texture.emplace();
  EXPECT_EQ(num_good(), 0);
  for (GuidedPhoto& photo : map.photos) photo.texture->bits.fill(0xff);
  EXPECT_EQ(num_good(), all_good);
}

TEST(Guidance, TheSkyBetweenTowersIsNoHoleHoweverAPhotoIsHeld) {
  for (const double roll_deg : {0.0, 90.0, 180.0, 270.0}) {
    Site site({FrontWall(-5, 2, 6), FrontWall(3, 2, 6), FrontWall(-3, 6, 1)});
    for (int i = 0; i < 8; ++i) {
      CameraPose pose = LookingAt({0.5 * i - 2, -8, 2}, {0, 0, 2});
      const Eigen::Vector3d centre = pose.Centre();
      if (i == 4) {
        pose.rotation =
            Eigen::AngleAxisd(roll_deg * kDegree, Eigen::Vector3d::UnitZ()) * pose.rotation;
      }
      pose.translation = -(pose.rotation * centre);
      site.Photograph(pose);
    }
    EXPECT_EQ(Assess(site.Map()).completeness.hole_share, 0)
        << "rolled by " << roll_deg << " degrees";
  }
}

TEST(Guidance, TheGroundHasBordersForThoseAloneWhoLookDown) {
  const Wall ground = {{-4, 0, 0}, {8, 0, 0}, {0, -8, 0}};
  Site ahead({FrontWall(-4, 8), ground}), down({ground});
  for (const double x : {-1.0, -0.5, 0.0, 0.5, 1.0}) {
    ahead.Photograph({x, -9, 2}, {x, 0, 1});
    down.Photograph({x, -4, 6}, {x, -3.9, 0});
  }
  const auto count_open = [](const Site& site, const Eigen::Vector3d& normal) {
    const Surface surface = MakeSurface(site.Map()).surface;
    return std::count_if(surface.surfels.begin(), surface.surfels.end(), [&](const Surfel& s) {
      return s.open_border && s.normal.dot(normal) > 0.9;
    });
  };
  EXPECT_EQ(count_open(ahead, Eigen::Vector3d::UnitZ()), 0);
  EXPECT_GT(count_open(ahead, -Eigen::Vector3d::UnitY()), 0);
  EXPECT_GT(count_open(down, Eigen::Vector3d::UnitZ()), 0);
}

TEST(Guidance, PhotosThatLookUpALittleDoNotTiltWhatIsUp) {
  Site site({});
  for (const double angle : {0.0, 30.0, 60.0, 90.0}) {
    const double x = std::cos(angle * kDegree), y = std::sin(angle * kDegree);
    site.Photograph({0, 0, 2}, {10 * x, 10 * y, 5});
  }
  EXPECT_GT(UpOf(site.Map()).z(), std::cos(2 * kDegree));
}

TEST(Guidance, AnEmptyMapIsNoPlace) {
  const PlaceQuality place = Assess(GuidedMap{});
  EXPECT_TRUE(place.surface.surfels.empty());
  EXPECT_FALSE(place.completeness.complete);
  EXPECT_TRUE(ChooseStations({}, place, {}).empty());
}

}  // namespace skein::guidance_test
