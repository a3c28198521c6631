// A session folder is input: somebody may have sent it. Whether services may open it.
#pragma once

#include <string>
#include <vector>

#include "core/result.h"
#include "ledger/session_folder.h"

namespace skein {

// Fails where something below the folder is neither a regular file nor a folder, where a file that
// is appended to has a second name, and where the keys were not made by this user on this host
// (auth/home_mark.h). With `adopt` such keys, the graph of retrieval and what an earlier launch.sh
// left in run/ are taken out: services make all of that again. Returns what was done, a line each.
// Ok of a folder that is missing.
Result<std::vector<std::string>> AdmitSession(const SessionPaths& paths, bool adopt);

}  // namespace skein
