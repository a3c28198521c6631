// Writes a model in the formats of other programs.
#pragma once

#include <base/reconstruction.h>

#include <filesystem>
#include <string>
#include <vector>

#include "core/result.h"

namespace skein {

// "bin", "text", "ply", "nerfstudio", "bundler", "nvm".
const std::vector<std::string>& ModelFormats();

// Writes cameras/images/points3D.bin or .txt, points.ply, transforms.json, bundle.out with
// bundle.out.list.txt, or model.nvm into `folder`, which must exist. COLMAP's writers ignore write
// errors, so their files are checked afterwards. An error names the incomplete file.
Status WriteModel(const colmap::Reconstruction& model, const std::string& format,
                  const std::filesystem::path& folder);

// nerfstudio's transforms.json: OpenGL camera axes, world as the model has it, photos under
// images/AGENT/NAME.
std::string NerfstudioJson(const colmap::Reconstruction& model);

}  // namespace skein
