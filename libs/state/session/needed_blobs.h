// Blobs that a session still needs. The rest may go: models that a newer one supersedes, and blobs
// that no fact names.
#pragma once

#include <set>
#include <string>

#include "session/session_state.h"

namespace skein {

// Photos, features, matches. Models: the newest one of each live submap, and that of a merge's
// source until the target's newest one holds it.
std::set<std::string> NeededBlobs(const SessionState& state);

}  // namespace skein
