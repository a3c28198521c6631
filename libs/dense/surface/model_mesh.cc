#include "surface/model_mesh.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <unordered_set>
#include <utility>

#include "surface/map_band.h"
#include "surface/surface_nets.h"

namespace skein {
namespace {

// A plane has 3 triangles a voxel's square: on average 1.5 edges cross it there. Its band of 8
// voxels touches 2.5 blocks for each 64 such squares, so a block has 77 triangles. Fewer are
// assumed: the first volume shall rather be too fine than too coarse.
constexpr double kTrianglesOfBlock = 40;
// Triangles grow with 1 / voxel^2, roughly: the next mesh shall fit.
constexpr double kMargin = 1.03;

// Blocks of a volume of all maps.
size_t CountBlocks(const std::vector<ColouredMap>& maps, double voxel) {
  std::unordered_set<BlockIndex, BlockHash> all;
  for (const ColouredMap& map : maps) {
    const auto blocks = MapBand(*map.map, voxel, NumHardwareThreads()).Blocks();
    all.insert(blocks.begin(), blocks.end());
  }
  return all.size();
}

double FirstVoxel(const std::vector<ColouredMap>& maps, double finest, const MeshOptions& options) {
  const double most_blocks =
      std::min(static_cast<double>(options.max_bytes) / sizeof(Block),
               static_cast<double>(options.max_triangles) / kTrianglesOfBlock);
  const double blocks = static_cast<double>(CountBlocks(maps, finest));
  return finest * std::max(1.0, std::sqrt(blocks / most_blocks));
}

// nullopt: the volume would take more than max_bytes.
std::optional<SurfaceMesh> MeshOfMaps(const std::vector<ColouredMap>& maps,
                                      const SurfaceOptions& options) {
  SurfaceVolume volume(options);
  for (const ColouredMap& map : maps) {
    if (!volume.Add(map).ok()) return std::nullopt;
  }
  return MeshOf(volume);
}

}  // namespace

Result<ModelMesh> MakeModelMesh(const std::vector<ColouredMap>& maps, const MeshOptions& options) {
  ModelMesh made;
  made.ground_sampling_distance = GroundSamplingDistance(maps);
  const Status none = FailedPrecondition("no surface that three photos agree on");
  if (!(made.ground_sampling_distance > 0)) return none;
  SurfaceOptions volume;
  volume.max_bytes = options.max_bytes;
  volume.voxel = FirstVoxel(maps, made.ground_sampling_distance, options);
  while (true) {
    std::optional<SurfaceMesh> mesh = MeshOfMaps(maps, volume);
    const double excess =
        mesh ? static_cast<double>(mesh->NumTriangles()) / options.max_triangles : 1;
    if (mesh && excess <= 1) {
      if (mesh->indices.empty()) return none;
      made.mesh = *std::move(mesh);
      made.voxel = volume.voxel;
      return made;
    }
    volume.voxel *= kMargin * std::sqrt(excess);
  }
}

}  // namespace skein
