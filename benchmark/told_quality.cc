#include "benchmark/told_quality.h"

#include <algorithm>
#include <limits>

#include "benchmark/feedback_quality.h"
#include "benchmark/point_grid.h"

namespace skein {
namespace {

double RadiusOf(const Piece& piece) { return 0.75 * piece.width; }

Told WhatIsToldOf(const SurfaceSample& sample, const std::vector<Piece>& pieces,
                  const PointGrid& positions, double radius) {
  double nearest = std::numeric_limits<double>::infinity();
  Told told = Told::kNothing;
  const bool knows_normal = !sample.normal.isZero();
  positions.ForNear(sample.xyz, radius, [&](uint32_t i, const Eigen::Vector3d& position) {
    const Piece& piece = pieces[i];
    const double away = (position - sample.xyz).norm();
    if (away >= std::min(nearest, RadiusOf(piece))) return true;
    if (knows_normal && piece.surfel.normal.dot(sample.normal) < 0.5) return true;
    nearest = away;
    told = piece.quality.counts && piece.quality.good ? Told::kGood : Told::kNotGood;
    return true;
  });
  return told;
}

}  // namespace

std::vector<Told> WhatIsTold(const PlaceQuality& place, const std::vector<SurfaceSample>& samples) {
  if (place.pieces.empty()) return std::vector<Told>(samples.size(), Told::kNothing);
  const double radius = RadiusOfSurfel(place.surface);
  PointGrid positions(radius);
  for (uint32_t i = 0; i < place.pieces.size(); ++i) {
    positions.Add(place.pieces[i].surfel.position, i);
  }
  std::vector<Told> told;
  for (const SurfaceSample& sample : samples) {
    told.push_back(WhatIsToldOf(sample, place.pieces, positions, radius));
  }
  return told;
}

}  // namespace skein
