// Between the merger's own types and Skein's messages.
#pragma once

#include "geometry/sim3_ransac.h"
#include "merger/merge_policy.h"
#include "merger/seed_policy.h"
#include "skein/merge_t.hpp"
#include "skein/seed_t.hpp"

namespace skein {

seed_t SeedMessage(const SeedChoice& choice);

// ORDERED or FAILED, by the result.
merge_t AttemptMessage(const MergeAttempt& attempt, const SessionState& session,
                       const Sim3Result& result, const Sim3Options& options, double duration_s,
                       int64_t evidence_utime_us);

}  // namespace skein
