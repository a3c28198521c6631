// Guidance and advice of a place, as messages.
#pragma once

#include "guide/place_guidance.h"
#include "skein/advice_t.hpp"
#include "skein/guidance_t.hpp"

namespace skein {

// With its session, author and trailer an advice fits into one Ethernet frame: viewpoints that do
// not, the last ones, are left out.
constexpr int kMaxAdviceBytes = 1040;

// The session is the bus's to fill in, the author the caller's.
guidance_t ToMessage(const PlaceGuidance& guidance);
advice_t ToMessage(const PlaceGuidance& guidance, const AgentAdvice& advice);

}  // namespace skein
