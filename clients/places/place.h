// A synthetic place: surfaces, their textures, the light. World frame: metres, z up.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "clients/places/scene.h"
#include "clients/places/texture.h"

namespace skein::sim {

struct Light {
  Eigen::Vector3f sun_direction = Eigen::Vector3f(0.4f, -0.5f, 0.76f).normalized();  // towards it
  float sun = 0.55f;
  float ambient = 0.74f;
  // Indoors: lamps in the middle of the ceilings, no sky.
  bool indoors = false;
};

struct Place {
  std::vector<Texture> textures;
  std::vector<float> grain_shift_m;  // of each texture, so that equal walls have equal grain
  std::vector<Texture> grain;        // one: the fine structure seen from close by, around 128
  Scene scene;
  Light light;
  int paint = 0, cloth = 0;  // textures of what comes and goes
};

}  // namespace skein::sim
