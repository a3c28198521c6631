// For JSON that somebody else wrote: the memory that a parser needs grows with its depth.
#pragma once

#include "core/bytes.h"

namespace skein {

// Whether no more than `max_depth` arrays and objects stand in one another.
bool IsShallowJson(const Bytes& text, int max_depth);

}  // namespace skein
