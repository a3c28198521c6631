#pragma once

#include <cstddef>
#include <map>
#include <string>
#include <vector>

#include "core/result.h"
#include "ledger/session_folder.h"

namespace skein {

constexpr const char* kModelFiles[] = {"cameras.bin", "images.bin", "points3D.bin"};

// Outcome of writing models.
struct WrittenModels {
  Status status;  // of the disk; unless ok, another try may succeed
  // Models that cannot be read, by their index in `model_blobs`, with the reason. If there are any,
  // nothing was replaced.
  std::map<size_t, std::string> damaged;

  bool ok() const { return status.ok() && damaged.empty(); }
};

// Writes the models, in the order given, as sparse/0, sparse/1, … in COLMAP's binary format, and
// removes those of an earlier finish. Readers see the old set or the new. `model_blobs` are ids of
// model archives in the session's blobs.
WrittenModels WriteModels(const SessionPaths& paths, const std::vector<std::string>& model_blobs);

}  // namespace skein
