// The surface of submaps as triangles, while their depth maps grow.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <set>
#include <string>

#include "core/bytes.h"
#include "dense/confirmed_map.h"
#include "formats/dense.h"

namespace skein {

struct LiveMeshOptions {
  int64_t max_bytes = 0;              // of blocks and depth maps, of all submaps
  int64_t max_triangles = 1'000'000;  // of all submaps
};

// The mesh of a submap as it can be published.
struct SubmapMesh {
  DenseManifest::Mesh list;
  std::map<std::string, std::shared_ptr<const Bytes>> blobs;  // of the list's chunks
};

// A volume for each submap (surface/surface_volume.h). Its voxels are as large as the ground
// sampling distance of its maps, as in surface/model_mesh.h, times 2^level. Beyond a limit the
// level of the submap with the most bytes or triangles grows by 1, and its maps keep every second
// row and column.
//
// The mesh is cut into chunks: cubes of 32^3 voxels. A chunk is made again when a block changed
// that it depends on. A map whose points move by more than a voxel, or that has other depths, is
// taken out and added again. A new volume is filled when most maps moved or the voxel changes; the
// chunks of the old volume stay until the new one is full. One thread, but it may be another one
// for each call.
class LiveMesh {
 public:
  explicit LiveMesh(const LiveMeshOptions& options);
  ~LiveMesh();

  // All maps of a submap, by image.
  void Update(int64_t submap_id, const std::map<uint32_t, ConfirmedMap>& maps);
  void Drop(int64_t submap_id);
  // The submap's mesh failed too often: it gets none any more.
  void LeaveOut(int64_t submap_id);
  bool IsLeftOut(int64_t submap_id) const { return left_out_.count(submap_id) > 0; }

  // Adds or takes out one map of the submap, or makes one chunk. False: nothing was to do. After an
  // exception the submap must be dropped.
  bool Step(int64_t submap_id, int64_t utime_us);

  SubmapMesh MeshOfSubmap(int64_t submap_id) const;
  // Rises with each change of what MeshOfSubmap returns.
  uint64_t changes() const { return changes_; }
  int64_t memory_bytes() const;
  int64_t num_triangles() const;
  // Side of the submap's voxels in its unit; 0: it has no volume.
  double VoxelOf(int64_t submap_id) const;

 private:
  class Submap;

  void KeepLimits();
  void CoarsenLargest(int64_t (Submap::*amount)() const, const char* limit);
  void Coarsen(int64_t submap_id, const char* limit);

  const LiveMeshOptions options_;
  std::map<int64_t, std::unique_ptr<Submap>> submaps_;
  std::set<int64_t> left_out_;
  uint64_t changes_ = 0;
};

}  // namespace skein
