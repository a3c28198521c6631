#pragma once

#include <cstdint>
#include <string>

#include "session/session_state.h"
#include "skein/submap_end_t.hpp"

namespace skein {

// The fact that a submap is no more; everyone who ends one makes it here. `epoch`: of its latest
// lease, 0 if it never had one. `merged_into`: 0 unless a merge brought its photos there.
submap_end_t MakeSubmapEnd(int64_t submap_id, int64_t epoch, const std::string& reason,
                           int64_t merged_into = 0);

// The end of a merge's source, once the merge is DONE.
submap_end_t MakeMergedEnd(const merge_t& done, const SessionState& state);

}  // namespace skein
