#pragma once

#include <filesystem>

#include "core/result.h"
#include "sfm/reconstruction.h"

namespace skein {

// The model's points with their colours, binary. Error: the file is not whole.
Status WritePointsPly(const Reconstruction& model, const std::filesystem::path& file);

}  // namespace skein
