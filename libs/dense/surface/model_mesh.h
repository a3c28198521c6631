// The mesh of all depth maps of a model, within a budget of triangles.
#pragma once

#include <cstdint>
#include <vector>

#include "core/result.h"
#include "surface/surface_mesh.h"
#include "surface/surface_volume.h"

namespace skein {

struct MeshOptions {
  int64_t max_triangles = 2'000'000;
  int64_t max_bytes = SurfaceOptions().max_bytes;  // of the volume
};

struct ModelMesh {
  SurfaceMesh mesh;
  double voxel = 0;
  double ground_sampling_distance = 0;  // a coarser voxel was needed for the limits
};

// A voxel is as large as the maps' ground sampling distance, or larger where the mesh would have
// more triangles or the volume more bytes. Error: no surface that the maps agree on.
Result<ModelMesh> MakeModelMesh(const std::vector<ColouredMap>& maps, const MeshOptions& options);

}  // namespace skein
