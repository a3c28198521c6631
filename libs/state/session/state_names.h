// Names of facts' states and causes in reports, events and status.
#pragma once

#include <cstdint>

namespace skein {

// "ordered", "frozen", ...: merge_t's states.
const char* MergeStateName(int8_t state);
// "requested", "drained", ...: finish_t's states.
const char* FinishStateName(int8_t state);
// "unreadable", "vanished", ...: failure_t's causes; "failed" for OTHER.
const char* FailureCauseName(int8_t cause);

}  // namespace skein
