#pragma once

#include <filesystem>

#include "clients/store/session_check.h"
#include "core/result.h"
#include "ledger/session_folder.h"

namespace skein {

// Copies a session to `to`, which must not exist, under an id of its own. The session may be in
// use: what is committed at the start is copied. Fails at what is damaged.
Result<Session> CloneSession(const SessionPaths& from, const std::filesystem::path& to,
                             const Progress& progress = {});

}  // namespace skein
