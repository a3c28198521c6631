// For tests: a plate before a wall, of which everything is known.
#pragma once

#include "clients/places/place.h"

namespace skein::sim {

inline Texture Plain(const cv::Vec3b& color) {
  return Texture(cv::Mat3b(8, 8, color), 8, Texture::Edge::kRepeat);
}

inline Surface FacingSouth(const Eigen::Vector3f& center, float size, int texture) {
  Surface surface;
  surface.origin = center + Eigen::Vector3f(-size / 2, 0, size / 2);
  surface.right = Eigen::Vector3f(size, 0, 0);
  surface.down = Eigen::Vector3f(0, 0, -size);
  surface.texture = texture;
  surface.detail = 0;
  return surface;
}

// A dark wall at y = 5 with a white plate in front of it.
inline Place PlateBeforeWall(const Eigen::Vector3f& plate, float size_m = 0.08f) {
  Place place;
  place.textures = {Plain({20, 20, 20}), Plain({230, 230, 230})};
  place.grain = {Plain({128, 128, 128})};
  place.grain_shift_m = {0, 0};
  place.scene = Scene({FacingSouth({0, 5, 0}, 40, 0), FacingSouth(plate, size_m, 1)});
  place.light.sun = 0;
  return place;
}

}  // namespace skein::sim
