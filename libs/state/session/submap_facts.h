#pragma once

#include <cstdint>
#include <string>

#include "session/session_state.h"
#include "skein/submap_end_t.hpp"

namespace skein {

// The fact that a submap has ended. `epoch`: of its latest lease, 0 if it was never leased.
// `merged_into`: the target if a merge moved its photos, else 0.
submap_end_t MakeSubmapEnd(int64_t submap_id, int64_t epoch, const std::string& reason,
                           int64_t merged_into = 0);

// The end of a merge's source, once the merge is DONE.
submap_end_t MakeMergedEnd(const merge_t& done, const SessionState& state);

}  // namespace skein
