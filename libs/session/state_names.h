// Names of facts' states in reports, events and status.
#pragma once

#include <cstdint>

namespace skein {

// "ordered", "frozen", ...: merge_t's states.
const char* MergeStateName(int8_t state);
// "requested", "drained", ...: finish_t's states.
const char* FinishStateName(int8_t state);

}  // namespace skein
