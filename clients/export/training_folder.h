// Folders that programs for radiance fields train on as they are.
#pragma once

#include <filesystem>
#include <functional>
#include <set>
#include <string>

#include "clients/export/photo_source.h"
#include "core/result.h"
#include "sfm/reconstruction.h"

namespace skein {

inline constexpr char kNerfstudio[] = "nerfstudio";
inline constexpr char kGaussianSplatting[] = "gaussian-splatting";

// Writes the model's photos, undistorted (clients/export/undistortion.h), into `folder`/images/,
// all in one folder: AGENT/A B.png becomes AGENT_A_B.jpg, as some readers take file names alone or
// split at blanks. images.names.txt has a line "AGENT_A_B.jpg", tab, "AGENT/A B.png" for each. And
// for
//  - "nerfstudio": transforms.json with PINHOLE cameras, points.ply;
//  - "gaussian-splatting": sparse/0 in COLMAP's binary format with PINHOLE cameras, as the
//    program of Kerbl et al. 2023 and gsplat read it.
// If a photo has borders, all photos are PNG files whose alpha is 0 there, and transforms.json
// names a mask for each, masks/camera-ID.png. on_photo: after each photo. `folder` must exist.
// Error: what cannot be undistorted, read or written; the folder is then incomplete.
Status WriteTrainingFolder(const Reconstruction& model, const std::set<std::string>& formats,
                           const PhotoSource& photos, const std::function<void()>& on_photo,
                           const std::filesystem::path& folder);

}  // namespace skein
