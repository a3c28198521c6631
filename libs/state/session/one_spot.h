#pragma once

#include <cstdint>

#include "session/session_state.h"

namespace skein {

// Whether all pairs between the registered photos of a submap tell that these were taken from one
// spot (CovisibilityGraph::IsOfOneSpot). The depth of such a map is invented. False without pairs.
// Costs the edges of its first photos until one tells of a step.
bool IsOfOneSpot(const SessionState& session, int64_t submap_id);

}  // namespace skein
