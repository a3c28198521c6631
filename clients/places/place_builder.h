// Puts a place together: boxes, façades with relief, whole buildings, rooms.
#pragma once

#include <functional>
#include <vector>

#include "clients/places/paint.h"
#include "clients/places/place.h"
#include "clients/places/random.h"

namespace skein::sim {

// A wall's own axes: `origin` is its upper left corner seen from outside; unit vectors.
struct WallFrame {
  Eigen::Vector3d origin, right, down, out;

  Eigen::Vector3f At(double u, double v, double o) const {
    return (origin + u * right + v * down + o * out).cast<float>();
  }
};

// A hole in a wall, metres from the wall's upper left corner.
struct Opening {
  double u, v, width, height;
  bool door = false;
};

class PlaceBuilder {
 public:
  using Painter = std::function<void(Random*, Sheet*)>;

  explicit PlaceBuilder(uint64_t seed);

  // Index of a texture that is painted by Build, from `seed` alone.
  int AddPainting(double width_m, double height_m, double texels_per_m, Texture::Edge edge,
                  uint64_t seed, Painter painter);
  int RandomTrim(Random* random) const;
  // The same in every place: plain paint and cloth, light grey with hardly any structure.
  int Paint() const { return paint_; }
  int Cloth() const { return cloth_; }

  void AddSurface(const Surface& surface) { surfaces_.push_back(surface); }
  void AddSurfaces(const std::vector<Surface>& surfaces) {
    surfaces_.insert(surfaces_.end(), surfaces.begin(), surfaces.end());
  }
  // The part (u, v, width, height) of a wall, moved out by `out_m`, with the wall's painting.
  void AddWallPart(const WallFrame& wall, const Opening& part, double out_m, int texture);
  // A box on a wall from `out0` to `out1`, without the face in the wall.
  void AddBoxOn(const WallFrame& wall, const Opening& part, double out0, double out1, int texture,
                Random* random);
  // A free-standing box. `base` is the middle of its foot, `size` along x, y, z before `yaw_rad`.
  void AddBox(const Eigen::Vector3d& base, const Eigen::Vector3d& size, double yaw_rad, int texture,
              Random* random);
  // A wall around recessed openings. `recess_m` is negative outwards.
  void AddPiercedWall(const WallFrame& wall, double width_m, double height_m,
                      const std::vector<Opening>& openings, double recess_m, int texture,
                      int reveal_texture, Random* random);

  Place Build(int threads, const Light& light);

 private:
  struct Painting {
    double width_m, height_m, texels_per_m;
    Texture::Edge edge;
    uint64_t seed;
    Painter painter;
  };
  void AddTrimSurface(Surface surface, int texture, Random* random);

  uint64_t seed_;
  std::vector<Painting> paintings_;
  std::vector<int> trims_;
  int paint_, cloth_;
  std::vector<Surface> surfaces_;
};

}  // namespace skein::sim
