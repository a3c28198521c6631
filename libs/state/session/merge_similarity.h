#pragma once

#include <optional>

#include "geometry/sim3_ransac.h"
#include "skein/merge_t.hpp"

namespace skein {

// The similarity target_from_source of a merge's facts.
void SetSimilarity(const Similarity& target_from_source, merge_t* merge);

// Normalises the rotation; a scale that is not positive and finite gives nullopt.
std::optional<Similarity> SimilarityOf(const merge_t& merge);

// The options that it was estimated with.
void SetSim3Options(const Sim3Options& options, merge_t* merge);
Sim3Options Sim3OptionsOf(const merge_t& merge);

}  // namespace skein
