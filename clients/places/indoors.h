// Indoor places: furnished rooms in a row joined by short corridors, and one long corridor.
#pragma once

#include "clients/places/place_builder.h"

namespace skein::sim {

// Room i's middle is at (i * kRoomPitchM, 0); an axis at y = 0 leads through all of them.
constexpr double kRoomPitchM = 11;
void AddRooms(int rooms, uint64_t seed, PlaceBuilder* builder);

// The same without corridors. In each stands a vending machine of one design, at another wall than
// in the room before; nothing else is alike.
void AddRoomsWithOneMachine(int rooms, uint64_t seed, PlaceBuilder* builder);

// From x = 0 to `length_m`, walls at y = +-kCorridorHalfWidthM; the furniture stands at y > 0.
constexpr double kCorridorHalfWidthM = 1.7;
void AddCorridor(double length_m, uint64_t seed, PlaceBuilder* builder);

}  // namespace skein::sim
