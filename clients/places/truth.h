// The exact model of a synthetic session, as a COLMAP text model.
#pragma once

#include <string>
#include <vector>

#include "clients/places/camera.h"
#include "clients/places/place.h"

namespace skein::sim {

struct TruePhoto {
  std::string name;  // AGENT/NAME
  int camera = 0;    // index into the cameras
  Pose pose;
  Scene moving;  // moving objects, which hide the place in this photo only
};

// Writes cameras.txt, images.txt and points3D.txt into `folder`, made when missing. The points are
// sampled on the surfaces from every photo with `seed`. A track holds every photo that sees its
// point. Large sessions have fewer points a photo. Throws std::runtime_error when a file cannot be
// written.
void WriteTruth(const std::string& folder, const Place& place, const std::vector<Camera>& cameras,
                const std::vector<TruePhoto>& photos, uint64_t seed, int threads);

// Every surface of the place as an exact mesh: ASCII PLY, metres, a face of four corners (a
// rectangle) or three (a gable) each. Throws std::runtime_error when the file cannot be written.
void WriteSurfaces(const std::string& file, const Scene& scene);

}  // namespace skein::sim
