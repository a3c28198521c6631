// A photo in the session folder.
#pragma once

#include <string>

#include "core/bytes.h"
#include "core/result.h"
#include "ledger/session_folder.h"

namespace skein {

// Makes the photo durable as a blob and as images/AGENT/NAME. The latter is a hard link to the
// blob, a copy where the file system has no links. A file that is there under that name is
// replaced. Refuses an agent and name that lead out of images/AGENT, as a forged ledger may hold.
Status StorePhoto(const SessionPaths& paths, const std::string& agent, const std::string& name,
                  const Bytes& bytes);

}  // namespace skein
