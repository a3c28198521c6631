#pragma once

#include <base/reconstruction.h>

#include <filesystem>

#include "core/result.h"

namespace skein {

// The model's points with their colours, binary. Error: the file is not whole.
Status WritePointsPly(const colmap::Reconstruction& model, const std::filesystem::path& file);

}  // namespace skein
