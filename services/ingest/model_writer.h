#pragma once

#include <string>
#include <vector>

#include "core/result.h"
#include "ledger/session_folder.h"

namespace skein {

// Writes the models, in the order given, as sparse/0, sparse/1, … in COLMAP's binary format, and
// removes those of an earlier finish. Readers see the old set or the new. `model_blobs` are ids of
// model archives in the session's blobs.
Status WriteModels(const SessionPaths& paths, const std::vector<std::string>& model_blobs);

}  // namespace skein
