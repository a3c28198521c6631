// Outdoor places: buildings with relief around squares.
#pragma once

#include "clients/places/place_builder.h"

namespace skein::sim {

struct BuildingSpec {
  Eigen::Vector2d center;
  double yaw_rad = 0;  // 0: its front looks along -y
  double width_m = 12, depth_m = 9, height_m = 9;
  int floors = 3;
  bool gable_roof = false;
  double texels_per_m = 120;       // of the front
  double side_texels_per_m = 120;  // of the other façades
  uint64_t seed = 1;
  // Not 0: two buildings of one seed have the same shape, walls, windows and doors. Stains, ivy,
  // graffiti and posters differ.
  uint64_t wear_seed = 0;
  bool neat = false;  // muted colours, no graffiti, few posters and little ivy
};

void AddBuilding(const BuildingSpec& spec, PlaceBuilder* builder);

// A square around `center`: a building in the middle, a ring of buildings, kiosks and crates
// between, a wall around all. Free to walk in: 10.5 m to 18 m from the centre.
struct SquareSpec {
  Eigen::Vector2d center = Eigen::Vector2d::Zero();
  uint64_t seed = 1;         // of the surroundings
  uint64_t middle_seed = 1;  // of the building in the middle
  uint64_t middle_wear_seed = 0;
  int ring = 8;
  bool building = true;  // in the middle, with piles around it
  bool neat = false;     // as BuildingSpec's, of all that surrounds the middle
};
constexpr double kRingFrontM = 26;  // distance of the ring's façades from the centre

void AddSquare(const SquareSpec& spec, PlaceBuilder* builder);

// A yard of 28 x 28 m between four façades of equal bays. Free to walk in: 11 m from the centre.
void AddCourtyard(uint64_t seed, PlaceBuilder* builder);

// A heap of gravel around the origin, of the slope of loose material (34 degrees), on open ground.
// Its volume is ConeVolume's (solids.h).
constexpr double kStockpileRadiusM = 6, kStockpileHeightM = 4;
void AddStockpile(uint64_t seed, PlaceBuilder* builder);

// Houses on open land, a square of `size_m` around the origin, as seen from a drone: paintings of
// 8 texels a metre.
void AddTown(double size_m, uint64_t seed, PlaceBuilder* builder);

}  // namespace skein::sim
