// Writes a model in the formats of other programs.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/result.h"
#include "sfm/reconstruction.h"

namespace skein {

// "bin", "text", "ply", "nerfstudio", "bundler", "nvm".
const std::vector<std::string>& ModelFormats();

// Writes cameras/images/points3D.bin or .txt, points.ply, transforms.json with points.ply,
// bundle.out with bundle.out.list.txt, or model.nvm into `folder`, which must exist. An error
// names the file that could not be written, or the camera that the format cannot hold
// (export/nerfstudio.h, export/nvm.h, export/simple_camera.h).
//
// "nerfstudio" is with the cameras and photos as they are: images/AGENT/NAME beside transforms.json
// are to be those of the session.
Status WriteModel(const Reconstruction& model, const std::string& format,
                  const std::filesystem::path& folder);

// "text", "bundler", "nvm": their readers part a line at blanks. Photos with blanks in their names
// are written with '_' there, and text.names.txt, bundle.out.names.txt or model.nvm.names.txt says
// which they are (export/written_names.h).
bool PartsNamesAtBlanks(const std::string& format);

}  // namespace skein
