// Depth maps of a model's photos, the dense points that they agree on, and these from above.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <set>
#include <string>

#include "clients/export/photo_source.h"
#include "clients/export/surface_quality.h"
#include "core/result.h"
#include "geometry/georeference.h"
#include "sfm/reconstruction.h"
#include "surface/model_mesh.h"

namespace skein {

inline constexpr char kDepth[] = "depth";
inline constexpr char kDense[] = "dense";
inline constexpr char kLas[] = "las";
inline constexpr char kMesh[] = "mesh";
inline constexpr char kOrthophoto[] = "orthophoto";

struct DenseOptions {
  std::set<std::string> formats;
  int size_px = 800;  // longer side of a depth map; a smaller photo keeps its own
  int64_t mesh_triangles = MeshOptions().max_triangles;
  // The model's frame, if it is on the earth: metres to the east, north and up of it.
  std::optional<GeodeticPosition> origin;
};

struct DenseFigures {
  SurfaceQuality quality;
  int64_t num_points = 0;     // of kDense and kLas
  int64_t num_triangles = 0;  // of kMesh
  int64_t num_textured = 0;   // of these, in mesh.glb
  // The orthophoto's: side of a cell, the share of the grid that has a colour, and where up comes
  // from (Ground::Up).
  double cell = 0, grid_completeness = 0;
  std::string up;
};

// Makes a depth map of each registered photo and keeps the depths that two other maps agree with
// and that others do not contradict (depth/model_depths.h). Writes for the formats
//  - "dense": dense.ply, points with normals and colours in the model's frame, binary;
//  - "las": dense.las, the same points without normals (export/las.h), on the earth if `origin` is
//    given;
//  - "mesh": the surface as triangles (surface/model_mesh.h): mesh.ply with a colour a vertex, and
//    mesh.glb, whose textures are parts of the photos (texture/mesh_texture.h) at their full size;
//    the glTF file has y up where `origin` is given, else the model's frame;
//  - "depth": in depth/, of each photo NAME.png (16 bit), NAME.pfm and NAME.error.pfm, and
//    cameras.json with scale, intrinsics, pose and counts of depths (depth/depth_quality.h) of
//    each; masks/PHOTO.JPG.png is the StaticMask (depth/consistency.h) of photo PHOTO.JPG, in its
//    size, undistorted;
//  - "orthophoto": orthophoto.tif, elevation.tif, hillshade.tif and orthophoto.json
//    (ground_files.h). Heights are above the ellipsoid or whatever the photos' altitudes are above,
//    else above the median camera; without `origin`, above the ground plane.
// and for all formats surface.json, the quality (surface_quality.h), which is also in the GeoTIFFs.
// clients/README.md describes the files. Takes up to 22 bytes a pixel of all depth maps on the disk
// of `folder` (depth/scratch_file.h), up to 80 bytes of memory a point, and up to 2 GiB while maps
// or a mesh are made. on_photo: after each photo, from any thread. `folder` must exist. Error: a
// photo cannot be read or has another size than its camera, no surface was found, or the disk has
// no room; the folder is then incomplete.
Result<DenseFigures> WriteDenseFolder(const Reconstruction& model, const DenseOptions& options,
                                      const PhotoSource& photos,
                                      const std::function<void()>& on_photo,
                                      const std::filesystem::path& folder);

}  // namespace skein
