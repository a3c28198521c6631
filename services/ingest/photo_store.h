#pragma once

#include <string>

#include "blobs/blob_store.h"
#include "core/bytes.h"
#include "core/result.h"
#include "ledger/session_folder.h"

namespace skein {

// Makes the photo durable as a blob and as images/AGENT/NAME, a hard link to it (a copy where the
// file system has no links). A file that a crash left under that name without a fact is replaced.
// Agent and name must have passed CheckAgentName and CheckPhotoName, or it throws
// std::invalid_argument.
Status StorePhoto(const SessionPaths& paths, const std::string& agent, const std::string& name,
                  const Bytes& bytes);

}  // namespace skein
