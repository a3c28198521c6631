#pragma once

#include <cstdint>

#include "retrieval/retrieval_state.h"
#include "skein/candidates_t.hpp"

namespace skein {

candidates_t ToMessage(const Candidates& candidates, int64_t computed_at_seq);

}  // namespace skein
