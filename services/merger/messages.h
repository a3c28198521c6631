// Between the merger's own types and Skein's messages.
#pragma once

#include <optional>
#include <vector>

#include "geometry/sim3_ransac.h"
#include "merger/merge_policy.h"
#include "merger/seed_policy.h"
#include "skein/matches_t.hpp"
#include "skein/merge_t.hpp"
#include "skein/seed_t.hpp"

namespace skein {

std::vector<VerifiedPair> PairsOf(const matches_t& matches);

seed_t SeedMessage(const SeedChoice& choice);

// ORDERED or FAILED, by the result. Its fact_id names the attempt: source, target, and how many
// photos they shared, so that a restarted merger cannot order it twice.
merge_t AttemptMessage(const MergeAttempt& attempt, const SubmapDirectory& directory,
                       const Sim3Result& result, double duration_s);

PendingMerge PendingOf(const merge_t& ordered);

}  // namespace skein
