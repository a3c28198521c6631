#include "clients/places/plain_room.h"

#include <array>
#include <cmath>

#include "clients/places/furniture.h"
#include "clients/places/solids.h"

namespace skein::sim {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kWallTexelsPerM = 110, kPictureTexelsPerM = 300;
constexpr float kWallDetail = 0.015f;

// Puts things along one wall. x runs along it from the viewer's left, y into it, z up.
class WallFurnisher {
 public:
  WallFurnisher(const Isometry3d& foot, double width_m, PlaceBuilder* builder, Random* random)
      : foot_(foot), width_m_(width_m), builder_(builder), random_(random) {}

  void AddWall() {
    Surface wall;
    wall.origin = (foot_ * Vector3d(0, 0, kPlainRoomHeightM)).cast<float>();
    wall.right = (foot_.linear() * Vector3d(width_m_, 0, 0)).cast<float>();
    wall.down = Eigen::Vector3f(0, 0, static_cast<float>(-kPlainRoomHeightM));
    wall.detail = kWallDetail;
    wall.texture = builder_->AddPainting(width_m_, kPlainRoomHeightM, kWallTexelsPerM,
                                         Texture::Edge::kClamp, random_->Next(), PaintPlainWall);
    builder_->AddSurface(wall);
    Block(width_m_ / 2, 0.008, 0, {width_m_, 0.016, 0.08}, White());  // skirting board
    Block(random_->Uniform(0.3, width_m_ - 0.3), 0.006, 0.3, {0.08, 0.012, 0.08}, White());
  }

  void AddDoor(double x) {
    const Material leaf = Tinted(builder_->Paint(), 0.7, 1.1, 0.06, random_);
    for (const double side : {-0.48, 0.48}) Block(x + side, 0.02, 0, {0.09, 0.04, 2.1}, White());
    Block(x, 0.02, 2.02, {1.05, 0.04, 0.09}, White());
    Block(x, 0.01, 0, {0.87, 0.02, 2.02}, leaf);
    for (const double z : {0.2, 1.15}) Block(x, 0.022, z, {0.6, 0.008, 0.7}, leaf);
    Block(x + 0.36, 0.05, 1.02, {0.12, 0.03, 0.02}, Dark());
    Block(x + 0.72, 0.008, 1.1, {0.085, 0.016, 0.085}, White());  // a switch
  }

  // Bright: a camera's exposure follows it.
  void AddWindow(double x) {
    Material pane{builder_->Paint(), {1.75f, 1.65f, 1.6f}, 0};
    Block(x, 0.01, 0.9, {1.4, 0.02, 1.3}, pane);
    for (const double side : {-0.7, 0.0, 0.7}) {
      Block(x + side, 0.035, 0.85, {0.07, 0.05, 1.4}, White());
    }
    for (const double z : {0.85, 2.18}) Block(x, 0.035, z, {1.45, 0.05, 0.07}, White());
    Block(x, 0.1, 0.8, {1.6, 0.2, 0.04}, White());
    Clutter(x, 0.12, 0.84, 0.6);
    const Material cloth = Tinted(builder_->Cloth(), 0.5, 1.0, 0.12, random_);
    for (const double side : {-1.0, 1.0}) {
      for (int fold = 0; fold < 5; ++fold) {
        Column(x + side * (0.68 + 0.08 * fold), 0.2 + random_->Uniform(-.02, .02), 0.15,
               {0.045, 0.05}, 2.2, cloth);
      }
    }
    for (int rib = 0; rib < 9; ++rib) {  // a radiator
      Block(x - 0.48 + 0.12 * rib, 0.07, 0.12, {0.09, 0.08, 0.55}, White());
    }
  }

  void AddPicture(double x) {
    const double width = random_->Uniform(0.3, 0.8), height = width * random_->Uniform(0.7, 1.4);
    const double foot = random_->Uniform(1.25, 1.5) - height / 4;
    const bool poster = random_->Chance(0.3);
    if (!poster) Block(x, 0.015, foot, {width + 0.06, 0.03, height + 0.06}, AnyWood());
    Surface sheet;
    sheet.origin = At(x - width / 2, poster ? 0.004 : 0.033, foot + 0.03 + height);
    sheet.right = (foot_.linear() * Vector3d(width, 0, 0)).cast<float>();
    sheet.down = Eigen::Vector3f(0, 0, static_cast<float>(-height));
    sheet.detail = kWallDetail;
    sheet.texture = builder_->AddPainting(width, height, kPictureTexelsPerM, Texture::Edge::kClamp,
                                          random_->Next(), [poster](Random* r, Sheet* s) {
                                            if (!poster) return PaintPicture(r, s);
                                            PaintPoster({{0, 0}, s->image.size()}, r, s);
                                          });
    builder_->AddSurface(sheet);
  }

  void AddWallShelf(double x) {
    Block(x, 0.1, 1.5, {0.8, 0.2, 0.025}, AnyWood());
    Clutter(x, 0.1, 1.525, 0.36);
  }

  void AddFurniture(double x) {
    switch (random_->Int(0, 4)) {
      case 0:
        return AddSofa(x);
      case 1:
        return AddShelf(x);
      case 2:
        return AddCupboard(x);
      case 3:
        return AddDesk(x);
      default:
        return AddPlant(x);
    }
  }

 private:
  Material White() const { return {builder_->Paint(), {1.1f, 1.12f, 1.12f}, 0.01f}; }
  Material Dark() const { return {builder_->Paint(), {0.2f, 0.2f, 0.2f}, 0.01f}; }
  Material AnyWood() {
    const float light = static_cast<float>(random_->Uniform(0.35, 0.95));
    return {builder_->Paint(), Eigen::Vector3f(0.55f, 0.78f, 1) * light, 0.02f};
  }
  Eigen::Vector3f At(double x, double depth, double z) const {
    return (foot_ * Vector3d(x, -depth, z)).cast<float>();
  }
  // `depth`: of the middle, from the wall into the room.
  Isometry3d Place(double x, double depth, double z) const {
    return foot_ * Eigen::Translation3d(x, -depth, z);
  }
  void Block(double x, double depth, double z, const Vector3d& size, const Material& material) {
    std::vector<Surface> surfaces;
    AddBlock(Place(x, depth, z), size, material, &surfaces);
    builder_->AddSurfaces(surfaces);
  }
  void Column(double x, double depth, double z, const Vector2d& radii, double height,
              const Material& material) {
    std::vector<Surface> surfaces;
    AddColumn(Place(x, depth, z), radii, height, material, &surfaces);
    builder_->AddSurfaces(surfaces);
  }

  // Small things in a row from x - `reach` to x + `reach`, some with a print.
  void Clutter(double x, double depth, double z, double reach) {
    for (double at = -reach; at < reach; at += random_->Uniform(0.06, 0.3)) {
      const double width = random_->Uniform(0.04, 0.14), height = random_->Uniform(0.04, 0.24);
      const bool printed = random_->Chance(0.5);
      const int texture = printed ? builder_->RandomTrim(random_) : builder_->Paint();
      const Material material = Tinted(texture, 0.2, 1.1, 0.3, random_);
      if (random_->Chance(0.4)) {
        Column(x + at, depth, z, {width / 2, width / 2}, height, material);
      } else {
        Block(x + at, depth, z, {width, random_->Uniform(0.03, 0.14), height}, material);
      }
    }
  }

  void AddSofa(double x) {
    const Material cloth = Tinted(builder_->Cloth(), 0.25, 0.85, 0.12, random_);
    Block(x, 0.45, 0.1, {1.7, 0.8, 0.3}, cloth);
    Block(x, 0.16, 0.4, {1.7, 0.2, 0.4}, cloth);
    for (const double side : {-0.95, 0.95}) Block(x + side, 0.45, 0.05, {0.2, 0.85, 0.55}, cloth);
    for (const double side : {-0.41, 0.41}) Block(x + side, 0.5, 0.4, {0.8, 0.65, 0.12}, cloth);
    Block(x + 0.5, 0.3, 0.5, {0.42, 0.14, 0.36}, Tinted(builder_->Cloth(), 0.3, 1.1, 0.3, random_));
  }

  void AddShelf(double x) {
    const Material wood = AnyWood();
    const double depth = 0.28;
    for (const double side : {-0.4, 0.4}) Block(x + side, depth / 2, 0, {0.02, depth, 1.9}, wood);
    for (double z = 0.06; z < 1.9; z += 0.36) {
      Block(x, depth / 2, z, {0.8, depth, 0.02}, wood);
      double at = -0.38;
      while (at < 0.3 && random_->Chance(0.93)) {  // books
        const double width = random_->Uniform(0.015, 0.05);
        Block(x + at + width / 2, 0.1, z + 0.02, {width, 0.2, random_->Uniform(0.18, 0.3)},
              Tinted(builder_->Paint(), 0.15, 1.1, 0.35, random_));
        at += width;
      }
    }
  }

  void AddCupboard(double x) {
    const Material wood = random_->Chance(0.5) ? White() : AnyWood();
    const double height = random_->Chance(0.5) ? 2.0 : 0.85;
    Block(x, 0.27, 0, {1.1, 0.54, height}, wood);
    for (const double side : {-0.27, 0.27}) {
      Block(x + side, 0.55, 0.05, {0.52, 0.016, height - 0.1}, wood);
      Block(x + side / 5, 0.57, 0.55 * height, {0.015, 0.03, 0.12}, Dark());
    }
    Clutter(x, 0.3, height, 0.45);
    if (height > 1) return;
    Block(x - 0.1, 0.2, height, {0.75, 0.05, 0.46}, Dark());  // a screen
    Column(x + 0.42, 0.25, height, {0.06, 0.06}, 0.22,
           Tinted(builder_->Paint(), 0.4, 1.1, 0.2, random_));
  }

  void AddDesk(double x) {
    const Material wood = AnyWood();
    Block(x, 0.36, 0.71, {1.3, 0.68, 0.03}, wood);
    for (const double side : {-0.6, 0.6}) {
      for (const double depth : {0.08, 0.64}) Block(x + side, depth, 0, {0.05, 0.05, 0.71}, wood);
    }
    Block(x, 0.35, 0.74, {0.33, 0.23, 0.02}, Dark());
    Block(x, 0.24, 0.76, {0.33, 0.012, 0.21}, Dark());
    Block(x + 0.45, 0.3, 0.74, {0.21, 0.3, 0.05}, White());
    Clutter(x, 0.25, 0.74, 0.55);
    const Material seat = Tinted(builder_->Cloth(), 0.2, 0.9, 0.15, random_);
    Block(x + 0.1, 0.8, 0.44, {0.44, 0.42, 0.05}, seat);
    Block(x + 0.1, 1.0, 0.49, {0.42, 0.03, 0.42}, seat);
    for (const double side : {-0.08, 0.28}) {
      for (const double depth : {0.62, 0.98}) {
        Column(x + side, depth, 0, {0.015, 0.015}, 0.44, Dark());
      }
    }
  }

  void AddPlant(double x) {
    Column(x, 0.35, 0, {0.17, 0.17}, 0.32, Tinted(builder_->Paint(), 0.4, 1.1, 0.15, random_));
    std::vector<Surface> leaves;
    for (int i = 0; i < 70; ++i) {
      const Isometry3d stem = Place(x, 0.35, random_->Uniform(0.3, 1.0)) *
                              Eigen::AngleAxisd(random_->Uniform(0, 2 * M_PI), Vector3d::UnitZ()) *
                              Eigen::Translation3d(random_->Uniform(0, 0.26), 0, 0) *
                              Eigen::AngleAxisd(random_->Uniform(0.2, 1.3), Vector3d::UnitY());
      const float light = static_cast<float>(random_->Uniform(0.2, 0.6));
      AddBlock(stem, {0.05, 0.002, random_->Uniform(0.1, 0.28)},
               {builder_->Cloth(), Eigen::Vector3f(0.5f, 0.85f, 0.62f) * light, 0.05f}, &leaves);
    }
    builder_->AddSurfaces(leaves);
  }

  const Isometry3d foot_;
  const double width_m_;
  PlaceBuilder* builder_;
  Random* random_;
};

void AddLevel(const PlainRoomSpec& spec, double z, PlaceBuilder::Painter painter,
              PlaceBuilder* builder, Random* random) {
  Surface slab;
  const Vector2d size = 2 * spec.half_m;
  slab.origin = Vector3d(-spec.half_m.x(), spec.half_m.y(), z).cast<float>();
  slab.right = Eigen::Vector3f(static_cast<float>(size.x()), 0, 0);
  slab.down = Eigen::Vector3f(0, static_cast<float>(-size.y()), 0);
  slab.detail = kWallDetail;
  slab.texture = builder->AddPainting(size.x(), size.y(), 1.5 * kWallTexelsPerM,
                                      Texture::Edge::kClamp, random->Next(), std::move(painter));
  builder->AddSurface(slab);
}

void AddMiddle(const PlainRoomSpec& spec, PlaceBuilder* builder, Random* random) {
  Surface rug;
  const Vector2d size = {std::min(2.2, spec.half_m.x()), 1.3};
  rug.origin = Vector3d(-size.x() / 2, size.y() / 2, 0.008).cast<float>();
  rug.right = Eigen::Vector3f(static_cast<float>(size.x()), 0, 0);
  rug.down = Eigen::Vector3f(0, static_cast<float>(-size.y()), 0);
  rug.texture = builder->AddPainting(size.x(), size.y(), 200, Texture::Edge::kClamp, random->Next(),
                                     PaintRug);
  builder->AddSurface(rug);
  std::vector<Surface> table;
  const Isometry3d foot = Isometry3d::Identity() * Eigen::Translation3d(0.1, 0, 0);
  const Material wood{builder->Paint(), {0.35f, 0.5f, 0.65f}, 0.03f};
  const Material top = Tinted(builder->Paint(), 0.4, 1.1, 0.3, random);
  AddBlock(foot * Eigen::Translation3d(0, 0, 0.4), {0.9, 0.55, 0.03}, wood, &table);
  AddBlock(foot, {0.3, 0.3, 0.4}, wood, &table);
  AddColumn(foot * Eigen::Translation3d(0.2, 0.1, 0.43), {0.09, 0.09}, 0.07, top, &table);
  AddBlock(foot * Eigen::Translation3d(-0.2, -0.05, 0.43), {0.3, 0.21, 0.015}, top, &table);
  builder->AddSurfaces(table);
}

void FurnishWall(const PlainRoomSpec& spec, int side, double width, WallFurnisher* wall,
                 Random* random) {
  constexpr double kCellM = 1.75;
  wall->AddWall();
  const int cells = std::max(2, static_cast<int>((width - 0.8) / kCellM));
  const int special = random->Int(0, cells - 1);
  for (int i = 0; i < cells; ++i) {
    const double x = 0.4 + (width - 0.8) * (i + 0.5) / cells + random->Uniform(-0.15, 0.15);
    if (i == special && side % 2 == 0) {
      side == 0 ? wall->AddDoor(x) : wall->AddWindow(x);
      continue;
    }
    if (random->Chance(spec.furnished)) wall->AddFurniture(x);
    if (random->Chance(0.4 * spec.furnished)) wall->AddWallShelf(x + random->Uniform(-0.3, 0.3));
    if (random->Chance(0.75 * spec.furnished)) wall->AddPicture(x + random->Uniform(-0.5, 0.5));
  }
}

}  // namespace

void AddPlainRoom(const PlainRoomSpec& spec, PlaceBuilder* builder) {
  Random random(spec.seed);
  const double x = spec.half_m.x(), y = spec.half_m.y();
  const std::array<Vector2d, 4> corners = {Vector2d(-x, y), Vector2d(x, y), Vector2d(x, -y),
                                           Vector2d(-x, -y)};
  for (int side = 0; side < 4; ++side) {  // clockwise: from the viewer's left to the right
    const Vector2d& from = corners[side];
    const Vector2d along = corners[(side + 1) % 4] - from;
    const Isometry3d foot = Eigen::Translation3d(from.x(), from.y(), 0) *
                            Eigen::AngleAxisd(std::atan2(along.y(), along.x()), Vector3d::UnitZ());
    WallFurnisher wall(foot, along.norm(), builder, &random);
    FurnishWall(spec, side, along.norm(), &wall, &random);
  }
  AddLevel(spec, 0, PaintPlainFloor, builder, &random);
  AddLevel(spec, kPlainRoomHeightM, PaintPlainWall, builder, &random);
  if (spec.table_columns > 0) {
    AddTables(Isometry3d::Identity(), spec.table_columns, 2, random.Next(), builder);
  } else {
    AddMiddle(spec, builder, &random);
  }
}

}  // namespace skein::sim
