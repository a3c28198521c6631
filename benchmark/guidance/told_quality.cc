#include "benchmark/guidance/told_quality.h"

#include <algorithm>
#include <limits>

#include "benchmark/guidance/feedback_quality.h"
#include "benchmark/support/point_grid.h"
#include "guidance/borders.h"

namespace skein {
namespace {

double RadiusOf(const Piece& piece) { return 0.75 * piece.width; }

// The nearest piece of each sample; null: there is none.
std::vector<const Piece*> NearestPieces(const PlaceQuality& place,
                                        const std::vector<SurfaceSample>& samples) {
  std::vector<const Piece*> nearest(samples.size(), nullptr);
  if (place.pieces.empty()) return nearest;
  const double radius = RadiusOfSurfel(place.surface);
  PointGrid positions(radius);
  for (uint32_t i = 0; i < place.pieces.size(); ++i) {
    positions.Add(place.pieces[i].surfel.position, i);
  }
  for (size_t i = 0; i < samples.size(); ++i) {
    const SurfaceSample& sample = samples[i];
    const bool knows_normal = !sample.normal.isZero();
    double least = std::numeric_limits<double>::infinity();
    positions.ForNear(sample.xyz, radius, [&](uint32_t index, const Eigen::Vector3d& position) {
      const Piece& piece = place.pieces[index];
      const double away = (position - sample.xyz).norm();
      if (away >= std::min(least, RadiusOf(piece))) return true;
      if (knows_normal && piece.surfel.normal.dot(sample.normal) < 0.5) return true;
      least = away;
      nearest[i] = &piece;
      return true;
    });
  }
  return nearest;
}

Told WhatIsToldOf(const Piece* piece) {
  if (piece == nullptr) return Told::kNothing;
  return piece->quality.counts && piece->quality.good ? Told::kGood : Told::kNotGood;
}

}  // namespace

std::vector<Told> WhatIsTold(const PlaceQuality& place, const std::vector<SurfaceSample>& samples) {
  std::vector<Told> told;
  for (const Piece* piece : NearestPieces(place, samples)) told.push_back(WhatIsToldOf(piece));
  return told;
}

std::vector<bool> AreGround(const GuidedMap& map, const PlaceQuality& place,
                            const std::vector<SurfaceSample>& samples) {
  const Eigen::Vector3d up = UpOf(map);
  const bool looks_ahead = LooksAhead(map, up);
  const std::vector<const Piece*> nearest = NearestPieces(place, samples);
  std::vector<bool> ground;
  for (size_t i = 0; i < samples.size(); ++i) {
    Surfel surfel;
    surfel.normal = samples[i].normal;
    const bool knows_normal = !samples[i].normal.isZero();
    ground.push_back(knows_normal ? IsGround(surfel, up, looks_ahead)
                                  : nearest[i] != nullptr && nearest[i]->surfel.is_ground);
  }
  return ground;
}

}  // namespace skein
