// Free-standing things put together from flat surfaces: blocks, columns, people, cars, a statue.
#pragma once

#include <Eigen/Geometry>
#include <vector>

#include "clients/places/random.h"
#include "clients/places/scene.h"

namespace skein::sim {

struct Material {
  int texture = 0;
  Eigen::Vector3f tint = Eigen::Vector3f::Ones();  // blue, green, red
  float detail = 0.02f;                            // strength of the grain
};

// A material of `texture` in a random colour whose mean is between `low` and `high` of it.
Material Tinted(int texture, double low, double high, double saturation, Random* random);

// `foot`: x right, y backwards, z up; its origin is the middle of the solid's foot. Metres.
void AddBlock(const Eigen::Isometry3d& foot, const Eigen::Vector3d& size, const Material& material,
              std::vector<Surface>* surfaces);
// An elliptic column of ten flat sides.
void AddColumn(const Eigen::Isometry3d& foot, const Eigen::Vector2d& radii, double height_m,
               const Material& material, std::vector<Surface>* surfaces);

// A cone of 64 gables: a heap of loose material. A texture of its circumference fits around it.
void AddCone(const Eigen::Isometry3d& foot, double radius_m, double height_m,
             const Material& material, std::vector<Surface>* surfaces);
// Volume in AddCone's surfaces, exactly.
double ConeVolume(double radius_m, double height_m);

struct Clothes {
  Material skin, hair, upper, lower;
};
// A person who stands or walks, front to -y.
void AddPerson(const Eigen::Isometry3d& foot, double height_m, const Clothes& clothes,
               Random* random, std::vector<Surface>* surfaces);
// A passenger car along x.
void AddCar(const Eigen::Isometry3d& foot, const Material& paint, const Material& dark,
            std::vector<Surface>* surfaces);
// A figure on a stepped plinth, 6 m high.
void AddMonument(const Eigen::Isometry3d& foot, const Material& stone, const Material& bronze,
                 Random* random, std::vector<Surface>* surfaces);

}  // namespace skein::sim
