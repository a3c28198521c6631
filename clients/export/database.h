// A COLMAP database from a session's facts and blobs.
#pragma once

#include <filesystem>

#include "core/result.h"
#include "ledger/session_folder.h"

namespace skein {

struct DatabaseCounts {
  int images = 0, pairs = 0;
};

// Writes cameras, images, keypoints, descriptors, and the verified matches (as matches and as
// two-view geometries) of everything in the ledger, so that `colmap mapper` runs on them. Image and
// camera ids are Skein's. `file` must not exist. Shows a progress bar.
Result<DatabaseCounts> WriteDatabase(const SessionPaths& paths, const std::filesystem::path& file);

}  // namespace skein
