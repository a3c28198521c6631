// Meshes in the formats of other programs.
#pragma once

#include <string>
#include <vector>

#include "surface/surface_mesh.h"
#include "texture/mesh_texture.h"

namespace skein {

// A binary PLY file: vertices with x, y, z, nx, ny, nz (float, the frame of the maps' poses), red,
// green, blue (uchar), and faces of three vertex_indices.
std::string MeshPly(const SurfaceMesh& mesh);

// A binary glTF 2.0 file with one mesh. Each of `parts`, which are of this mesh, is a primitive:
// with its texture as a JPEG, or with the vertices' colours, linear, as glTF wants them. Neither is
// shaded (KHR_materials_unlit): the photos hold the light already. Positions are floats from the
// mesh's origin, which is the node's translation. glTF has y up and +z to the front: if the frame
// is `z_up`, (x, y, z) is written as (x, z, -y), else as it is. Throws std::invalid_argument
// without a part, and for a file of 4 GiB or more.
std::string MeshGlb(const SurfaceMesh& mesh, const std::vector<MeshPart>& parts, bool z_up);

}  // namespace skein
