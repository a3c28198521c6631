#include "benchmark/guidance/told_quality.h"

#include <gtest/gtest.h>

namespace skein::told_quality_test {

Piece PieceAt(const Eigen::Vector3d& position, bool good) {
  Piece piece;
  piece.surfel.position = position;
  piece.surfel.normal = Eigen::Vector3d::UnitZ();
  piece.width = 1;
  piece.quality.counts = true;
  piece.quality.good = good;
  return piece;
}

TEST(WhatIsTold, IsThatOfTheNearestPieceThatFacesTheSameWayAsFarAsIsKnown) {
  PlaceQuality place;
  place.surface.cell = 1;
  place.pieces = {PieceAt({0, 0, 0}, true), PieceAt({1, 0, 0}, false)};
  const Eigen::Vector3d up = Eigen::Vector3d::UnitZ();
  const std::vector<SurfaceSample> samples = {{{0.3, 0, 0.1}, up},
                                              {{0.6, 0, 0.1}, up},
                                              {{0.3, 0, -0.1}, -up},
                                              {{-0.7, 0.4, 0}, up},
                                              {{0.3, 0, -0.1}, {0, 0, 0}}};
  EXPECT_EQ(WhatIsTold(place, samples),
            (std::vector<Told>{Told::kGood, Told::kNotGood, Told::kNothing, Told::kNothing,
                               Told::kGood}));
}

TEST(WhatIsTold, IsNotGoodOfAPieceTooCoarseToCount) {
  PlaceQuality place;
  place.surface.cell = 1;
  place.pieces = {PieceAt({0, 0, 0}, true)};
  place.pieces[0].quality.counts = false;
  EXPECT_EQ(WhatIsTold(place, {{{0, 0, 0}, Eigen::Vector3d::UnitZ()}}),
            std::vector<Told>{Told::kNotGood});
}

TEST(WhatIsTold, IsNothingWithoutPieces) {
  EXPECT_EQ(WhatIsTold({}, {{{0, 0, 0}, Eigen::Vector3d::UnitZ()}}),
            std::vector<Told>{Told::kNothing});
}

}  // namespace skein::told_quality_test
