// How far a surface is to be trusted, as it is told with each of its files.
#pragma once

#include <cstddef>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "depth/depth_quality.h"
#include "depth/model_depths.h"

namespace skein {

// Lengths are in metres if in_metres, else in the model's unit.
struct SurfaceQuality {
  size_t num_photos = 0;
  bool in_metres = false;
  DepthCounts depths;                   // of all photos
  ErrorPercentiles expected_error;      // of the depths that stayed
  double completeness = 0;              // share of the photos' pixels that have a depth, mean
  double ground_sampling_distance = 0;  // median over the maps; 0 without depths
  std::optional<double> mesh_voxel;     // nullopt: no mesh was made
};

// Without a mesh.
SurfaceQuality QualityOf(const ModelDepths& depths, bool in_metres);

// agreed, contradicted, alone: how many depths of a photo.
nlohmann::json ToJson(const DepthCounts& counts);

// The content of surface.json: agreed, contradicted and alone are shares of `depths`, 0 where there
// is none. mesh_voxel is null without a mesh.
nlohmann::json ToJson(const SurfaceQuality& quality);

// The same as text, without what is null.
std::map<std::string, std::string> TextsOf(const SurfaceQuality& quality);

// A line for a person.
std::string LineOf(const SurfaceQuality& quality);

}  // namespace skein
