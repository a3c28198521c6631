#include "clients/places/indoors.h"

#include <cmath>

#include "clients/places/furniture.h"

namespace skein::sim {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kTexelsPerM = 220;
constexpr double kRoomHalfX = 4, kRoomHalfY = 3.5, kRoomHeight = 3.2;
constexpr double kPassageHalfY = 1.3, kPassageHeight = 2.6;

void PaintIndoorWall(Random* random, Sheet* sheet) {
  const WallKind kinds[] = {WallKind::kPlaster, WallKind::kPlanks, WallKind::kBrick,
                            WallKind::kStone};
  PaintWall(kinds[random->Int(0, 3)], random, sheet);
  const double w = sheet->width_m(), h = sheet->height_m();
  const int pictures = static_cast<int>(w * random->Uniform(1.2, 2.0));
  for (int i = 0; i < pictures; ++i) {
    const double width = random->Uniform(0.3, 1.1);
    PaintPoster(sheet->Box(random->Uniform(0, std::max(0.01, w - width)),
                           random->Uniform(0.2, h - 1), width, width * random->Uniform(0.6, 1.5)),
                random, sheet);
  }
  if (w > 3) {
    PaintGraffiti(sheet->Box(random->Uniform(0, w - 2), h - 1.8, 2, 1.2), random, sheet);
  }
}

void PaintCeiling(Random* random, Sheet* sheet) { PaintWall(WallKind::kConcrete, random, sheet); }

// A wall seen from inside a room, from `from` on the viewer's left to `to` on the right.
WallFrame InsideWall(const Vector2d& from, const Vector2d& to, double height) {
  WallFrame wall;
  wall.origin = Vector3d(from.x(), from.y(), height);
  const Vector2d along = (to - from).normalized();
  wall.right = Vector3d(along.x(), along.y(), 0);
  wall.down = -Vector3d::UnitZ();
  wall.out = wall.down.cross(wall.right);
  return wall;
}

int AddWallPainting(double width, double height, PlaceBuilder* builder, Random* random) {
  return builder->AddPainting(width, height, kTexelsPerM, Texture::Edge::kClamp, random->Next(),
                              PaintIndoorWall);
}

void AddPlainWall(const Vector2d& from, const Vector2d& to, double height, PlaceBuilder* builder,
                  Random* random) {
  const double width = (to - from).norm();
  builder->AddWallPart(InsideWall(from, to, height), {0, 0, width, height}, 0,
                       AddWallPainting(width, height, builder, random));
}

// A wall with the way to a corridor in its middle.
void AddWallWithPassage(const Vector2d& from, const Vector2d& to, PlaceBuilder* builder,
                        Random* random) {
  const double width = (to - from).norm(), side = width / 2 - kPassageHalfY;
  const WallFrame wall = InsideWall(from, to, kRoomHeight);
  const int texture = AddWallPainting(width, kRoomHeight, builder, random);
  builder->AddWallPart(wall, {0, 0, side, kRoomHeight}, 0, texture);
  builder->AddWallPart(wall, {width - side, 0, side, kRoomHeight}, 0, texture);
  builder->AddWallPart(wall, {side, 0, 2 * kPassageHalfY, kRoomHeight - kPassageHeight}, 0,
                       texture);
}

void AddSlab(const Vector2d& low, const Vector2d& high, double z, PlaceBuilder::Painter painter,
             PlaceBuilder* builder, Random* random) {
  Surface surface;
  surface.origin = Vector3d(low.x(), high.y(), z).cast<float>();
  surface.right = Eigen::Vector3f(static_cast<float>(high.x() - low.x()), 0, 0);
  surface.down = Eigen::Vector3f(0, static_cast<float>(low.y() - high.y()), 0);
  surface.texture = builder->AddPainting(high.x() - low.x(), high.y() - low.y(), 150,
                                         Texture::Edge::kClamp, random->Next(), painter);
  builder->AddSurface(surface);
}

void AddFloorAndCeiling(const Vector2d& low, const Vector2d& high, double height,
                        PlaceBuilder* builder, Random* random) {
  AddSlab(low, high, 0, PaintFloor, builder, random);
  AddSlab(low, high, height, PaintCeiling, builder, random);
}

// A shelf, cupboard or desk against a wall, with things on it.
void AddFurniture(const Vector2d& at, double along_x, double along_y, PlaceBuilder* builder,
                  Random* random) {
  const double height = random->Chance(0.4) ? random->Uniform(1.5, 2.1) : random->Uniform(0.5, 1);
  builder->AddBox({at.x(), at.y(), 0}, {along_x, along_y, height}, random->Uniform(-0.05, 0.05),
                  builder->RandomTrim(random), random);
  for (int i = random->Int(1, 4); i > 0; --i) {
    const double size = random->Uniform(0.12, 0.35);
    builder->AddBox({at.x() + random->Uniform(-.4, .4) * along_x,
                     at.y() + random->Uniform(-.3, .3) * along_y, height},
                    {size, size * random->Uniform(0.5, 1), size * random->Uniform(0.5, 1.6)},
                    random->Uniform(0, M_PI), builder->RandomTrim(random), random);
  }
}

void FurnishRoom(double x, PlaceBuilder* builder, Random* random) {
  for (const double side : {-1.0, 1.0}) {
    for (double u = -3.1; u < 3.2; u += random->Uniform(1.4, 2.2)) {
      const double length = random->Uniform(0.6, 1.2), depth = random->Uniform(0.3, 0.6);
      AddFurniture({x + u, side * (kRoomHalfY - depth / 2 - 0.02)}, length, depth, builder, random);
    }
    for (const double v : {-2.1, 2.1}) {
      AddFurniture({x + side * (kRoomHalfX - 0.3), v}, 0.5, random->Uniform(0.6, 1), builder,
                   random);
    }
  }
}

void AddRoom(double x, bool west, bool east, PlaceBuilder* builder, Random* random) {
  const Vector2d nw(x - kRoomHalfX, kRoomHalfY), ne(x + kRoomHalfX, kRoomHalfY);
  const Vector2d sw(x - kRoomHalfX, -kRoomHalfY), se(x + kRoomHalfX, -kRoomHalfY);
  AddPlainWall(nw, ne, kRoomHeight, builder, random);
  AddPlainWall(se, sw, kRoomHeight, builder, random);
  const auto end = [&](bool open, const Vector2d& from, const Vector2d& to) {
    if (open) {
      AddWallWithPassage(from, to, builder, random);
    } else {
      AddPlainWall(from, to, kRoomHeight, builder, random);
    }
  };
  end(east, ne, se);
  end(west, sw, nw);
  AddFloorAndCeiling(sw, ne, kRoomHeight, builder, random);
  FurnishRoom(x, builder, random);
}

void AddPassage(double x0, double x1, PlaceBuilder* builder, Random* random) {
  const Vector2d low(x0, -kPassageHalfY), high(x1, kPassageHalfY);
  AddPlainWall({x0, high.y()}, high, kPassageHeight, builder, random);
  AddPlainWall({x1, low.y()}, low, kPassageHeight, builder, random);
  AddFloorAndCeiling(low, high, kPassageHeight, builder, random);
  for (const double side : {-1.0, 1.0}) {
    AddFurniture({(x0 + x1) / 2 + random->Uniform(-.6, .6), side * (kPassageHalfY - 0.15)}, 0.7,
                 0.25, builder, random);
  }
}

}  // namespace

void AddRooms(int rooms, uint64_t seed, PlaceBuilder* builder) {
  Random random(seed);
  for (int i = 0; i < rooms; ++i) {
    const double x = i * kRoomPitchM;
    AddRoom(x, i > 0, i + 1 < rooms, builder, &random);
    if (i + 1 < rooms) {
      AddPassage(x + kRoomHalfX, x + kRoomPitchM - kRoomHalfX, builder, &random);
    }
  }
}

void AddRoomsWithOneMachine(int rooms, uint64_t seed, PlaceBuilder* builder) {
  Random random(seed);
  const uint64_t design = random.Next();
  for (int i = 0; i < rooms; ++i) {
    AddRoom(i * kRoomPitchM, false, false, builder, &random);
    const double side = i % 2 == 0 ? 1 : -1;  // its back to the east or the west wall
    const double x = i * kRoomPitchM + side * (kRoomHalfX - kVendingMachineDepthM / 2 - 0.05);
    AddVendingMachine(Eigen::Translation3d(x, random.Uniform(-0.8, 0.8), 0) *
                          Eigen::AngleAxisd(-side * M_PI / 2, Vector3d::UnitZ()) *
                          Eigen::Isometry3d::Identity(),
                      design, builder);
  }
}

void AddCorridor(double length_m, uint64_t seed, PlaceBuilder* builder) {
  constexpr double kHeight = 2.9, kBay = 6;
  Random random(seed);
  const int bays = static_cast<int>(std::ceil(length_m / kBay));
  for (int i = 0; i < bays; ++i) {
    const double x0 = i * kBay, x1 = x0 + kBay, half = kCorridorHalfWidthM;
    const WallFrame north = InsideWall({x0, half}, {x1, half}, kHeight);
    const int texture = AddWallPainting(kBay, kHeight, builder, &random);
    const std::vector<Opening> doors = {{random.Uniform(0.4, 1.2), 0.6, 1.0, kHeight - 0.6, true},
                                        {random.Uniform(3.2, 4.4), 0.5, 1.1, 1.6}};
    builder->AddPiercedWall(north, kBay, kHeight, doors, 0.35, texture,
                            builder->RandomTrim(&random), &random);
    builder->AddBoxOn(north, {0.02, 0, 0.3, kHeight}, 0, 0.2, builder->RandomTrim(&random),
                      &random);
    AddFurniture({x0 + 2.4, half - 0.25}, random.Uniform(0.6, 1.1), 0.45, builder, &random);
    AddFurniture({x0 + 5.4, half - 0.2}, random.Uniform(0.5, 0.9), 0.35, builder, &random);
    AddPlainWall({x1, -half}, {x0, -half}, kHeight, builder, &random);
    AddFloorAndCeiling({x0, -half}, {x1, half}, kHeight, builder, &random);
  }
  const double end = bays * kBay, half = kCorridorHalfWidthM;
  AddPlainWall({0, -half}, {0, half}, kHeight, builder, &random);
  AddPlainWall({end, half}, {end, -half}, kHeight, builder, &random);
}

}  // namespace skein::sim
