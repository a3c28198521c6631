#include "clients/places/outdoors.h"

#include <algorithm>
#include <cmath>

#include "clients/places/solids.h"

namespace skein::sim {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kWindowRecessM = 0.28;
constexpr double kNeatMute = 0.6;
constexpr double kWallDistanceM = 46;

std::vector<Opening> LayOutWindows(double width_m, double height_m, int floors, Random* random) {
  std::vector<Opening> openings;
  const int columns = std::max(2, static_cast<int>(width_m / random->Uniform(2.3, 3.0)));
  const double cell = width_m / columns, floor_height = height_m / floors;
  const double window_w = cell * random->Uniform(0.42, 0.55);
  const double window_h = floor_height * random->Uniform(0.45, 0.58);
  const int door_column = random->Int(0, columns - 1);
  for (int row = 0; row < floors; ++row) {
    for (int column = 0; column < columns; ++column) {
      const double u = (column + 0.5) * cell - window_w / 2;
      const double top = row * floor_height + 0.22 * floor_height;
      const bool door = row == floors - 1 && column == door_column;
      if (!door && random->Chance(0.08)) continue;  // a blind window
      openings.push_back({u, top, window_w, door ? height_m - top : window_h, door});
    }
  }
  return openings;
}

// `style`: of the kind of wall, the windows and the door. `random`: of what time and people add.
// The two may be one.
void PaintWear(int floors, Random* random, Sheet* sheet) {
  const double w = sheet->width_m(), h = sheet->height_m(), ground = h - h / floors;
  for (int i = random->Int(2, 4); i > 0; --i) {
    PaintIvy(sheet->Box(random->Uniform(-1, w - 1), h - random->Uniform(1.5, 0.8 * h),
                        random->Uniform(1, 3), h),
             random, sheet);
  }
  for (int i = random->Int(1, 3); i > 0; --i) {
    PaintGraffiti(sheet->Box(random->Uniform(0, w - 2), h - 2.2, random->Uniform(1.5, 3), 1.5),
                  random, sheet);
  }
  for (int i = random->Int(3, 7); i > 0; --i) {
    const double width = random->Uniform(0.5, 1.3);
    PaintPoster(sheet->Box(random->Uniform(0, w - width), ground + random->Uniform(0.3, 1.2), width,
                           width * random->Uniform(0.8, 1.6)),
                random, sheet);
  }
  for (int i = random->Int(0, 2); i > 0; --i) {  // a large one high up
    PaintPoster(sheet->Box(random->Uniform(0, w - 2), random->Uniform(0.2, ground),
                           random->Uniform(1.4, 3), random->Uniform(0.8, 2)),
                random, sheet);
  }
}

void PaintFacade(const std::vector<Opening>& openings, int floors, bool neat, Random* style,
                 Random* random, Sheet* sheet) {
  const auto kind = static_cast<WallKind>(style->Int(0, static_cast<int>(WallKind::kCount) - 1));
  PaintWall(kind, random, sheet);
  if (neat) {
    PaintPoster(
        sheet->Box(random->Uniform(0, sheet->width_m() - 1), sheet->height_m() - 1.9, 0.8, 1),
        random, sheet);
  } else {
    PaintWear(floors, random, sheet);
  }
  for (const Opening& o : openings) {
    PaintStreaks(sheet->Box(o.u - 0.1, o.v + o.height, o.width + 0.2, 1.2), random, sheet);
    const cv::Rect box = sheet->Box(o.u, o.v, o.width, o.height);
    if (o.door) {
      PaintDoor(box, style, sheet);
    } else {
      PaintWindow(box, style, sheet);
    }
  }
  if (neat) Mute(kNeatMute, sheet);
}

void AddBalcony(const WallFrame& wall, const Opening& o, int texture, PlaceBuilder* builder,
                Random* random) {
  const double u = o.u - 0.35, width = o.width + 0.7, foot = o.v + o.height, reach = 0.9;
  builder->AddBoxOn(wall, {u, foot, width, 0.14}, 0, reach, texture, random);
  const double rail = foot - 0.75;
  builder->AddBoxOn(wall, {u, rail, width, 0.1}, reach - 0.07, reach, texture, random);
  const int bars = std::max(2, static_cast<int>(width / 0.32));
  for (int i = 0; i <= bars; ++i) {
    builder->AddBoxOn(wall, {u + (width - 0.07) * i / bars, rail + 0.1, 0.07, 0.65}, reach - 0.07,
                      reach, texture, random);
  }
}

void AddRelief(const WallFrame& wall, double width_m, double height_m, int floors,
               const std::vector<Opening>& openings, PlaceBuilder* builder, Random* random) {
  const int cornice = builder->RandomTrim(random), sill = builder->RandomTrim(random);
  for (int floor = 0; floor < floors; ++floor) {
    const double v = floor * height_m / floors, reach = floor == 0 ? 0.4 : 0.14;
    builder->AddBoxOn(wall, {-0.05, v, width_m + 0.1, 0.2}, 0, reach, cornice, random);
  }
  const double balconies = random->Chance(0.6) ? 0.3 : 0.1;
  for (const Opening& o : openings) {
    if (o.door) {
      builder->AddBoxOn(wall, {o.u - 0.3, o.v - 0.2, o.width + 0.6, 0.16}, 0, 0.8, sill, random);
    } else if (o.v + o.height < height_m - height_m / floors && random->Chance(balconies)) {
      AddBalcony(wall, o, sill, builder, random);
    } else {
      builder->AddBoxOn(wall, {o.u - 0.1, o.v + o.height, o.width + 0.2, 0.09}, 0, 0.18, sill,
                        random);
      if (random->Chance(0.15)) {
        builder->AddBoxOn(wall, {o.u + o.width + 0.15, o.v + o.height - 0.5, 0.6, 0.45}, 0.05, 0.4,
                          builder->RandomTrim(random), random);
      }
    }
  }
  for (int i = 0; i < 2; ++i) {  // pilasters, or drain pipes
    const double pipe = random->Chance(0.5) ? 0.12 : 0.5;
    const double u = i == 0 ? 0.05 : width_m - 0.05 - pipe;
    builder->AddBoxOn(wall, {u, 0.2, pipe, height_m - 0.2}, 0, 0.16, builder->RandomTrim(random),
                      random);
  }
}

// `wear_seed`: 0, or of its own wear (see BuildingSpec).
void AddFacade(const WallFrame& wall, double width_m, double height_m, int floors,
               double texels_per_m, uint64_t seed, uint64_t wear_seed, bool neat,
               PlaceBuilder* builder) {
  Random random(seed);
  const std::vector<Opening> openings = LayOutWindows(width_m, height_m, floors, &random);
  const uint64_t style_seed = random.Next();
  const int texture = builder->AddPainting(
      width_m, height_m, texels_per_m, Texture::Edge::kClamp, style_seed ^ wear_seed,
      [openings, floors, style_seed, wear_seed, neat](Random* r, Sheet* sheet) {
        Random style(style_seed);
        PaintFacade(openings, floors, neat, wear_seed == 0 ? r : &style, r, sheet);
      });
  builder->AddPiercedWall(wall, width_m, height_m, openings, kWindowRecessM, texture,
                          builder->RandomTrim(&random), &random);
  AddRelief(wall, width_m, height_m, floors, openings, builder, &random);
}

// `walls`: front, right, back, left.
void AddRoof(const BuildingSpec& spec, const WallFrame walls[4], PlaceBuilder* builder,
             Random* random) {
  const double w = spec.width_m, d = spec.depth_m, rise = 0.35 * d;
  const int texture = builder->AddPainting(
      w + 1, d + 1, std::min(40.0, spec.side_texels_per_m), Texture::Edge::kClamp, random->Next(),
      [](Random* r, Sheet* sheet) { PaintWall(WallKind::kBrick, r, sheet); });
  const auto add = [&](const Eigen::Vector3f& origin, const Eigen::Vector3f& right,
                       const Eigen::Vector3f& down, Surface::Shape shape) {
    Surface surface;
    surface.origin = origin;
    surface.right = right - origin;
    surface.down = down - origin;
    surface.shape = shape;
    surface.texture = texture;
    builder->AddSurface(surface);
  };
  if (!spec.gable_roof) {
    add(walls[2].At(w, 0, 0), walls[2].At(0, 0, 0), walls[0].At(0, 0, 0),
        Surface::Shape::kRectangle);
    return;
  }
  for (const int side : {0, 2}) {  // slopes
    add(walls[side].At(0, -rise, -d / 2), walls[side].At(w, -rise, -d / 2),
        walls[side].At(0, 0.1, 0.3), Surface::Shape::kRectangle);
  }
  for (const int side : {1, 3}) {
    add(walls[side].At(0, -rise, 0), walls[side].At(d, -rise, 0), walls[side].At(0, 0, 0),
        Surface::Shape::kGable);
  }
}

void AddPile(const Vector2d& at, PlaceBuilder* builder, Random* random) {
  double foot = 0, size = random->Uniform(0.8, 1.7);
  for (int i = random->Int(1, 3); i > 0; --i) {
    const double height = size * random->Uniform(0.4, 0.9);
    builder->AddBox({at.x() + random->Uniform(-.1, .1), at.y() + random->Uniform(-.1, .1), foot},
                    {size, size * random->Uniform(0.6, 1), height}, random->Uniform(0, M_PI),
                    builder->RandomTrim(random), random);
    foot += height;
    size *= random->Uniform(0.5, 0.85);
  }
}

// A square of ground. `corner`: its smallest x and largest y.
void AddGroundTile(const Vector2d& corner, double side_m, double texels_per_m, uint64_t seed,
                   const PlaceBuilder::Painter& paint, PlaceBuilder* builder) {
  Surface surface;
  surface.origin = Vector3d(corner.x(), corner.y(), 0).cast<float>();
  surface.right = Eigen::Vector3f(static_cast<float>(side_m), 0, 0);
  surface.down = Eigen::Vector3f(0, static_cast<float>(-side_m), 0);
  surface.texture =
      builder->AddPainting(side_m, side_m, texels_per_m, Texture::Edge::kClamp, seed, paint);
  builder->AddSurface(surface);
}

void AddGround(const Vector2d& center, bool neat, PlaceBuilder* builder, Random* random) {
  const auto paint = [neat](Random* r, Sheet* sheet) {
    PaintGround(r, sheet);
    if (neat) Mute(kNeatMute, sheet);
  };
  const double half = kWallDistanceM + 2, tile = half / 2;
  for (int i = 0; i < 4; ++i) {
    for (int j = 0; j < 4; ++j) {
      const bool inner = (i == 1 || i == 2) && (j == 1 || j == 2);
      AddGroundTile({center.x() - half + i * tile, center.y() - half + (j + 1) * tile}, tile,
                    inner ? 70 : 35, random->Next(), paint, builder);
    }
  }
}

void AddSurroundingWall(const Vector2d& center, bool neat, PlaceBuilder* builder, Random* random) {
  constexpr int kSides = 12;
  const double length = 2 * kWallDistanceM * std::tan(M_PI / kSides) + 0.2;
  for (int i = 0; i < kSides; ++i) {
    const double angle = 2 * M_PI * i / kSides, height = random->Uniform(5, 11);
    const Vector3d out(-std::cos(angle), -std::sin(angle), 0);
    WallFrame wall;
    wall.right = Vector3d(std::sin(angle), -std::cos(angle), 0);
    wall.down = -Vector3d::UnitZ();
    wall.out = out;
    wall.origin =
        Vector3d(center.x(), center.y(), height) - kWallDistanceM * out - wall.right * length / 2;
    AddFacade(wall, length, height, std::max(2, static_cast<int>(height / 3)), 45, random->Next(),
              0, neat, builder);
  }
}

// The windows of a façade of equal bays.
std::vector<Opening> EqualWindows(double width_m, double height_m, int columns, int floors) {
  const double cell = width_m / columns, floor_height = height_m / floors;
  std::vector<Opening> openings;
  for (int row = 0; row < floors; ++row) {
    for (int column = 0; column < columns; ++column) {
      openings.push_back({(column + 0.25) * cell, (row + 0.2) * floor_height, cell / 2,
                          0.55 * floor_height, false});
    }
  }
  return openings;
}

// One bay, again and again; streaks, ivy and posters alone differ.
void PaintEqualBays(uint64_t bay_seed, const std::vector<Opening>& openings, int columns,
                    int floors, Random* random, Sheet* sheet) {
  Random bay_random(bay_seed);
  Sheet bay(sheet->width_m() / columns, sheet->height_m() / floors, sheet->texels_per_m);
  PaintWall(WallKind::kPlaster, &bay_random, &bay);
  PaintSpeckle(6, 0.03, 0.15, 0.5, &bay_random, &bay);
  PaintWindow(bay.Box(openings[0].u, openings[0].v, openings[0].width, openings[0].height),
              &bay_random, &bay);
  for (int y = 0; y < sheet->image.rows; y += bay.image.rows) {
    for (int x = 0; x < sheet->image.cols; x += bay.image.cols) {
      const cv::Rect box =
          cv::Rect({x, y}, bay.image.size()) & cv::Rect({0, 0}, sheet->image.size());
      bay.image(cv::Rect({0, 0}, box.size())).copyTo(sheet->image(box));
    }
  }
  for (const Opening& o : openings) {
    PaintStreaks(sheet->Box(o.u - 0.1, o.v + o.height, o.width + 0.2, 0.6), random, sheet);
  }
  PaintIvy(sheet->Box(random->Uniform(0, sheet->width_m() - 3), sheet->height_m() - 6, 2, 6),
           random, sheet);
  for (int i = 0; i < 8; ++i) {
    const double u = random->Uniform(0, sheet->width_m() - 1);
    PaintPoster(sheet->Box(u, sheet->height_m() - 1.9, 0.8, 1), random, sheet);
  }
  Mute(kNeatMute, sheet);
}

void PaintGravel(Random* random, Sheet* sheet) {
  sheet->image.setTo(RandomColor(random, 110, 150, 0.15));
  PaintSpeckle(150, 0.03, 0.3, 0.45, random, sheet);
  Modulate(Noise(sheet->image.size(), sheet->Px(2), 1, 0.8f, random), 0.15f, &sheet->image);
}

// A field or a meadow with bushes and stones.
void PaintLand(Random* random, Sheet* sheet) {
  sheet->image.setTo(RandomColor(random, 80, 150, 0.15));
  PaintSpeckle(0.3, 0.3, 3, 0.5, random, sheet);
  Modulate(Noise(sheet->image.size(), sheet->Px(30), 1, 0.8f, random), 0.2f, &sheet->image);
}

}  // namespace

void AddStockpile(uint64_t seed, PlaceBuilder* builder) {
  Random random(seed);
  AddGround(Vector2d::Zero(), false, builder, &random);
  Material gravel;
  gravel.detail = Surface().detail;
  gravel.texture = builder->AddPainting(2 * M_PI * kStockpileRadiusM,
                                        std::hypot(kStockpileRadiusM, kStockpileHeightM), 70,
                                        Texture::Edge::kRepeat, random.Next(), PaintGravel);
  std::vector<Surface> heap;
  AddCone(Eigen::Isometry3d::Identity(), kStockpileRadiusM, kStockpileHeightM, gravel, &heap);
  builder->AddSurfaces(heap);
}

void AddTown(double size_m, uint64_t seed, PlaceBuilder* builder) {
  constexpr double kBlockM = 50, kTexelsPerM = 8;
  Random random(seed);
  const int blocks = static_cast<int>(std::ceil(size_m / kBlockM));
  for (int i = 0; i < blocks * blocks; ++i) {
    const Vector2d corner =
        Vector2d(i % blocks, i / blocks) * kBlockM - Vector2d::Constant(blocks * kBlockM / 2);
    AddGroundTile(corner + Vector2d(0, kBlockM), kBlockM, kTexelsPerM, random.Next(), PaintLand,
                  builder);
    const Vector2d aside(random.Uniform(0.4, 0.6), random.Uniform(0.4, 0.6));
    const int floors = random.Int(1, 5);
    AddBuilding({corner + kBlockM * aside, random.Uniform(0, M_PI), random.Uniform(9, 20),
                 random.Uniform(8, 14), 3.1 * floors, floors, random.Chance(0.5), kTexelsPerM,
                 kTexelsPerM, random.Next()},
                builder);
  }
}

void AddCourtyard(uint64_t seed, PlaceBuilder* builder) {
  constexpr double kDistanceM = 14, kHeightM = 10;
  constexpr int kColumns = 10, kFloors = 3;
  Random random(seed);
  AddGround(Vector2d::Zero(), true, builder, &random);
  const double length = 2 * kDistanceM;
  const std::vector<Opening> openings = EqualWindows(length, kHeightM, kColumns, kFloors);
  for (int i = 0; i < 4; ++i) {
    const double angle = i * M_PI / 2;
    WallFrame wall;
    wall.right = Vector3d(std::sin(angle), -std::cos(angle), 0);
    wall.down = -Vector3d::UnitZ();
    wall.out = Vector3d(-std::cos(angle), -std::sin(angle), 0);
    wall.origin = Vector3d(0, 0, kHeightM) - kDistanceM * wall.out - wall.right * length / 2;
    const uint64_t bay_seed = random.Next();
    const int texture =
        builder->AddPainting(length, kHeightM, 110, Texture::Edge::kClamp, random.Next(),
                             [bay_seed, openings](Random* r, Sheet* sheet) {
                               PaintEqualBays(bay_seed, openings, kColumns, kFloors, r, sheet);
                             });
    builder->AddPiercedWall(wall, length, kHeightM, openings, kWindowRecessM, texture,
                            builder->Paint(), &random);
  }
}

void AddBuilding(const BuildingSpec& spec, PlaceBuilder* builder) {
  Random random(spec.seed);
  const Vector3d x(std::cos(spec.yaw_rad), std::sin(spec.yaw_rad), 0);
  const Vector3d y(-x.y(), x.x(), 0);
  const Vector3d top(spec.center.x(), spec.center.y(), spec.height_m);
  const double w = spec.width_m, d = spec.depth_m;
  const Vector3d down = -Vector3d::UnitZ();
  const WallFrame walls[4] = {{top - x * w / 2 - y * d / 2, x, down, -y},
                              {top + x * w / 2 - y * d / 2, y, down, x},
                              {top + x * w / 2 + y * d / 2, -x, down, y},
                              {top - x * w / 2 + y * d / 2, -y, down, -x}};
  for (int i = 0; i < 4; ++i) {
    AddFacade(walls[i], i % 2 == 0 ? w : d, spec.height_m, spec.floors,
              i == 0 ? spec.texels_per_m : spec.side_texels_per_m, random.Next(), spec.wear_seed,
              spec.neat, builder);
  }
  AddRoof(spec, walls, builder, &random);
}

void AddSquare(const SquareSpec& spec, PlaceBuilder* builder) {
  Random random(spec.seed);
  AddGround(spec.center, spec.neat, builder, &random);
  AddSurroundingWall(spec.center, spec.neat, builder, &random);
  Random middle(spec.middle_seed);
  if (spec.building) {
    AddBuilding({spec.center, middle.Uniform(0, 1), 9.5, 8, 9, 3, true, 125, 125, middle.Next(),
                 spec.middle_wear_seed},
                builder);
  }
  for (int i = 0; i < spec.ring; ++i) {
    const double angle = 2 * M_PI * (i + random.Uniform(-0.08, 0.08)) / spec.ring;
    const double depth = random.Uniform(7, 10), distance = kRingFrontM + depth / 2;
    const int floors = random.Int(2, 4);
    const Vector2d at = spec.center + distance * Vector2d(std::cos(angle), std::sin(angle));
    const double width = 2 * M_PI * kRingFrontM / spec.ring * random.Uniform(0.62, 0.78);
    AddBuilding({at, angle - M_PI / 2, width, depth, floors * random.Uniform(2.9, 3.4), floors,
                 random.Chance(0.5), 110, 50, random.Next(), 0, spec.neat},
                builder);
  }
  for (int i = 0; i < 22; ++i) {
    if (i % 3 == 0 && !spec.building) continue;
    const double angle = 2 * M_PI * (i + random.Uniform(0, 0.8)) / 22;
    const double distance = i % 3 == 0 ? random.Uniform(7.6, 9) : random.Uniform(20.5, 23.5);
    AddPile(spec.center + distance * Vector2d(std::cos(angle), std::sin(angle)), builder, &random);
  }
}

}  // namespace skein::sim
