// Tourists' photos of a monument, each with a camera and passers-by of its own.
#pragma once

#include <vector>

#include "clients/places/camera.h"
#include "clients/places/effects.h"
#include "clients/places/place_builder.h"

namespace skein::sim {

// A square with a monument in its middle.
void AddMonumentSquare(uint64_t seed, PlaceBuilder* builder);

Pose TouristPose(Random* random);

struct TouristCamera {
  Camera camera;     // of the photo as published
  double sensor_px;  // the longer side before the photo was cropped: EXIF still tells of that
};
// No side is longer than `max_side_px`. Half of the photos are cropped: each side loses up to a
// fifth, so the principal point is off by up to a tenth.
TouristCamera MakeTouristCamera(int max_side_px, Random* random);

Exposure TouristExposure(Random* random);

// People and cars in front of `pose`. `paint` and `cloth` are textures.
std::vector<Surface> PassersBy(const Pose& pose, int paint, int cloth, Random* random);

}  // namespace skein::sim
