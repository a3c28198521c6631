// A furnished room with painted walls: hardly any texture but for pictures, edges and things.
#pragma once

#include "clients/places/place_builder.h"

namespace skein::sim {

struct PlainRoomSpec {
  Eigen::Vector2d half_m = {3.2, 2.6};  // its middle is the origin
  double furnished = 0.7;               // share of the places along the walls with something there
  uint64_t seed = 1;
  int table_columns = 0;  // not 0: two rows of equal tables in the middle
};
constexpr double kPlainRoomHeightM = 2.6;

// Free to walk in: further than 1.15 m from the walls.
void AddPlainRoom(const PlainRoomSpec& spec, PlaceBuilder* builder);

}  // namespace skein::sim
