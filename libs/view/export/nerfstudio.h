#pragma once

#include <filesystem>
#include <functional>
#include <string>

#include "core/result.h"
#include "sfm/reconstruction.h"

namespace skein {

// Relative to the folder of transforms.json.
struct NerfstudioFiles {
  std::string photo;
  std::string mask;  // "": none; else every photo has one
};
using NerfstudioFilesOf = std::function<NerfstudioFiles(const Image&)>;

// nerfstudio's transforms.json (docs.nerf.studio/quickstart/data_conventions.html): OpenGL camera
// axes, the model's world, the points in points.ply. Parameters are written as they are: of
// PINHOLE, and as OPENCV or OPENCV_FISHEYE of each of COLMAP's models that is a special case.
// Error: other cameras (FOV, THIN_PRISM_FISHEYE, FULL_OPENCV with a denominator), and fisheye
// beside perspective ones, as a file has one camera model.
Result<std::string> NerfstudioJson(const Reconstruction& model, const NerfstudioFilesOf& files_of);

// transforms.json and points.ply, into a folder that exists.
Status WriteNerfstudio(const Reconstruction& model, const std::filesystem::path& folder,
                       const NerfstudioFilesOf& files_of);

}  // namespace skein
