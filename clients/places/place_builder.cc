#include "clients/places/place_builder.h"

#include <cmath>
#include <opencv2/imgproc.hpp>
#include <optional>

#include "clients/places/parallel.h"

namespace skein::sim {
namespace {

constexpr int kTrims = 8;
constexpr double kGrainSizeM = 6, kGrainTexelsPerM = 320;

Texture PaintGrain(uint64_t seed) {
  Random random(seed);
  const int size = static_cast<int>(kGrainSizeM * kGrainTexelsPerM);
  cv::Mat3b grain(size, size, cv::Vec3b(128, 128, 128));
  Modulate(Noise(grain.size(), 24, 1, 0.85f, &random), 0.33f, &grain);
  return Texture(grain, static_cast<float>(kGrainTexelsPerM), Texture::Edge::kRepeat);
}

Surface Rectangle(const Eigen::Vector3f& origin, const Eigen::Vector3f& right_end,
                  const Eigen::Vector3f& down_end) {
  Surface surface;
  surface.origin = origin;
  surface.right = right_end - origin;
  surface.down = down_end - origin;
  return surface;
}

}  // namespace

PlaceBuilder::PlaceBuilder(uint64_t seed) : seed_(seed) {
  for (int i = 0; i < kTrims; ++i) {
    trims_.push_back(
        AddPainting(3, 3, 180, Texture::Edge::kRepeat, Random(seed).Fork(i).Next(), PaintTrim));
  }
  const Random plain(seed ^ 0x706c61696eULL);
  paint_ = AddPainting(3, 3, 60, Texture::Edge::kRepeat, plain.Fork(0).Next(), PaintPlain);
  cloth_ = AddPainting(3, 3, 100, Texture::Edge::kRepeat, plain.Fork(1).Next(), PaintCloth);
}

int PlaceBuilder::AddPainting(double width_m, double height_m, double texels_per_m,
                              Texture::Edge edge, uint64_t seed, Painter painter) {
  paintings_.push_back({width_m, height_m, texels_per_m, edge, seed, std::move(painter)});
  return static_cast<int>(paintings_.size()) - 1;
}

int PlaceBuilder::RandomTrim(Random* random) const { return trims_[random->Int(0, kTrims - 1)]; }

void PlaceBuilder::AddWallPart(const WallFrame& wall, const Opening& part, double out_m,
                               int texture) {
  if (part.width < 1e-3 || part.height < 1e-3) return;
  Surface surface =
      Rectangle(wall.At(part.u, part.v, out_m), wall.At(part.u + part.width, part.v, out_m),
                wall.At(part.u, part.v + part.height, out_m));
  surface.texture = texture;
  surface.uv = Eigen::Vector2d(part.u, part.v).cast<float>();
  AddSurface(surface);
}

void PlaceBuilder::AddTrimSurface(Surface surface, int texture, Random* random) {
  surface.texture = texture;
  surface.uv = Eigen::Vector2f(static_cast<float>(random->Uniform(0, 50)),
                               static_cast<float>(random->Uniform(0, 50)));
  AddSurface(surface);
}

void PlaceBuilder::AddBoxOn(const WallFrame& wall, const Opening& p, double out0, double out1,
                            int texture, Random* random) {
  const double u0 = p.u, u1 = p.u + p.width, v0 = p.v, v1 = p.v + p.height;
  const cv::Scalar color = RandomColor(random, 0.75, 1.15, 0.12);
  const Eigen::Vector3d tint(color[0], color[1], color[2]);
  const auto face = [&](const Eigen::Vector3f& o, const Eigen::Vector3f& r,
                        const Eigen::Vector3f& d) {
    Surface surface = Rectangle(o, r, d);
    surface.tint = tint.cast<float>();
    AddTrimSurface(surface, texture, random);
  };
  face(wall.At(u0, v0, out1), wall.At(u1, v0, out1), wall.At(u0, v1, out1));
  face(wall.At(u0, v0, out0), wall.At(u0, v0, out1), wall.At(u0, v1, out0));
  face(wall.At(u1, v0, out1), wall.At(u1, v0, out0), wall.At(u1, v1, out1));
  face(wall.At(u0, v0, out0), wall.At(u1, v0, out0), wall.At(u0, v0, out1));
  face(wall.At(u0, v1, out1), wall.At(u1, v1, out1), wall.At(u0, v1, out0));
}

void PlaceBuilder::AddBox(const Eigen::Vector3d& base, const Eigen::Vector3d& size, double yaw_rad,
                          int texture, Random* random) {
  const Eigen::Vector3d x(std::cos(yaw_rad), std::sin(yaw_rad), 0);
  const Eigen::Vector3d y(-x.y(), x.x(), 0);
  WallFrame front;
  front.origin = base - x * size.x() / 2 - y * size.y() / 2 + Eigen::Vector3d(0, 0, size.z());
  front.right = x;
  front.down = -Eigen::Vector3d::UnitZ();
  front.out = -y;
  AddBoxOn(front, {0, 0, size.x(), size.z()}, -size.y(), 0, texture, random);
  Surface back = Rectangle(front.At(size.x(), 0, -size.y()), front.At(0, 0, -size.y()),
                           front.At(size.x(), size.z(), -size.y()));
  AddTrimSurface(back, texture, random);
}

void PlaceBuilder::AddPiercedWall(const WallFrame& wall, double width_m, double height_m,
                                  const std::vector<Opening>& openings, double recess_m,
                                  int texture, int reveal_texture, Random* random) {
  // Vertical strips: a column of openings shares its u range, so the wall is cut at every edge.
  std::vector<double> cuts = {0, width_m};
  for (const Opening& o : openings) {
    cuts.push_back(o.u);
    cuts.push_back(o.u + o.width);
  }
  std::sort(cuts.begin(), cuts.end());
  for (size_t i = 0; i + 1 < cuts.size(); ++i) {
    const double u0 = cuts[i], u1 = cuts[i + 1], middle = (u0 + u1) / 2;
    if (u1 - u0 < 1e-3) continue;
    std::vector<std::pair<double, double>> holes;
    for (const Opening& o : openings) {
      if (o.u < middle && middle < o.u + o.width) holes.emplace_back(o.v, o.v + o.height);
    }
    std::sort(holes.begin(), holes.end());
    double v = 0;
    for (const auto& [top, bottom] : holes) {
      AddWallPart(wall, {u0, v, u1 - u0, top - v}, 0, texture);
      v = bottom;
    }
    AddWallPart(wall, {u0, v, u1 - u0, height_m - v}, 0, texture);
  }
  for (const Opening& o : openings) {
    const double u0 = o.u, u1 = o.u + o.width, v0 = o.v, v1 = o.v + o.height, r = -recess_m;
    AddWallPart(wall, o, r, texture);
    AddTrimSurface(Rectangle(wall.At(u0, v0, 0), wall.At(u0, v0, r), wall.At(u0, v1, 0)),
                   reveal_texture, random);
    AddTrimSurface(Rectangle(wall.At(u1, v0, r), wall.At(u1, v0, 0), wall.At(u1, v1, r)),
                   reveal_texture, random);
    AddTrimSurface(Rectangle(wall.At(u0, v0, 0), wall.At(u1, v0, 0), wall.At(u0, v0, r)),
                   reveal_texture, random);
    AddTrimSurface(Rectangle(wall.At(u0, v1, r), wall.At(u1, v1, r), wall.At(u0, v1, 0)),
                   reveal_texture, random);
  }
}

Place PlaceBuilder::Build(int threads, const Light& light) {
  std::vector<std::optional<Texture>> painted(paintings_.size());
  ParallelFor(static_cast<int>(paintings_.size()), threads, [&](int i) {
    const Painting& p = paintings_[i];
    Random random(p.seed);
    Sheet sheet(p.width_m, p.height_m, static_cast<float>(p.texels_per_m));
    p.painter(&random, &sheet);
    painted[i].emplace(sheet.image, static_cast<float>(p.texels_per_m), p.edge);
  });
  Place place;
  for (auto& texture : painted) place.textures.push_back(std::move(*texture));
  for (const Painting& p : paintings_) {
    place.grain_shift_m.push_back(static_cast<float>(p.seed % 4096) / 4096 * kGrainSizeM);
  }
  place.grain.push_back(PaintGrain(seed_));
  place.scene = Scene(surfaces_);
  place.light = light;
  place.paint = paint_;
  place.cloth = cloth_;
  return place;
}

}  // namespace skein::sim
