#pragma once

#include <filesystem>

#include "core/result.h"
#include "sfm/reconstruction.h"

namespace skein {

// A model in a folder as COLMAP has it (colmap.github.io/format.html): cameras, images, points3D,
// as .bin or .txt. Files are written in the order of ids, with registered images alone.

// Reads the binary files if points3D.bin is there, else the text. Every count, id and index is
// checked. An error names the file that is missing or damaged. Points get new ids, in the order of
// the file.
Result<Reconstruction> ReadModelFiles(const std::filesystem::path& folder);

// Into a folder that exists. An error names the file that could not be written.
Status WriteModelBinary(const Reconstruction& model, const std::filesystem::path& folder);
Status WriteModelText(const Reconstruction& model, const std::filesystem::path& folder);

}  // namespace skein
