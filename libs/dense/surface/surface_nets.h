// The mesh of a signed distance volume, by naive surface nets (Gibson 1998).
//
// A cell has the samples of eight voxels at its corners. A cell whose corners lie on both sides of
// the surface gets one vertex, at the mean of the surface's crossings of the cell's edges. An edge
// that crosses the surface gets two triangles between the vertices of the four cells around it.
#pragma once

#include "surface/surface_mesh.h"
#include "surface/surface_volume.h"

namespace skein {

// Weight of a voxel below which it counts as unknown: one map that is 2.8 voxels off
// (map_band.h).
constexpr int kLeastWeight = kMostWeight / 32;

// Only cells with eight known corners have a vertex, so there is no surface between known and
// unknown space, and what no photo shows stays a hole. Vertices are shared.
SurfaceMesh MeshOf(const SurfaceVolume& volume);

// The triangles of MeshOf that belong to the side^3 blocks from `first` on, with their vertices.
// The meshes of cubes side by side have the triangles of MeshOf, each once. A vertex on their
// common border is in both, at the same position. Depends on these blocks and those that touch them
// alone.
SurfaceMesh MeshOfCube(const SurfaceVolume& volume, const BlockIndex& first, int side);

}  // namespace skein
