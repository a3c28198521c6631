// Furniture that repeats: the same shape with the same pictures wherever it stands. A foot is as in
// solids.h, and fronts look to its -y.
#pragma once

#include <Eigen/Geometry>

#include "clients/places/place_builder.h"

namespace skein::sim {

// 0.95 x 0.75 m, 1.85 m high: goods behind glass, posters on its sides. Machines of one `design`
// are alike.
constexpr double kVendingMachineDepthM = 0.75;
void AddVendingMachine(const Eigen::Isometry3d& foot, uint64_t design, PlaceBuilder* builder);

// A canteen: tables, each with two chairs and what lies on it, 2 m apart, all alike.
void AddTables(const Eigen::Isometry3d& middle, int columns, int rows, uint64_t design,
               PlaceBuilder* builder);

}  // namespace skein::sim
