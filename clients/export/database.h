// A COLMAP database from a session's facts and blobs.
#pragma once

#include <filesystem>

#include "core/result.h"
#include "ledger/session_folder.h"

namespace skein {

struct DatabaseCounts {
  int images = 0, pairs = 0;
};

// Writes a database that `colmap mapper` runs on: cameras, images, keypoints, descriptors and
// verified matches of everything in the ledger. Verified matches are written as matches and as
// two-view geometries. Image and camera ids are Skein's. `file` must not exist. Shows a progress
// bar.
Result<DatabaseCounts> WriteDatabase(const SessionPaths& paths, const std::filesystem::path& file);

}  // namespace skein
