// Guidance's verdict on a place, piece by piece of its surface.
#pragma once

#include <vector>

#include "benchmark/support/photo_pool.h"
#include "guidance/quality.h"

namespace skein {

enum class Told { kNothing, kNotGood, kGood };

// For each sample the verdict on the piece nearest to it: within 0.75 of the piece's width, its
// normal within 60 degrees of the sample's if that is known. kNothing: there is no such piece.
std::vector<Told> WhatIsTold(const PlaceQuality& place, const std::vector<SurfaceSample>& samples);

// Whether each sample is of the ground, which does not count: by its normal, or else by the piece
// nearest to it, as above. place: of the map.
std::vector<bool> AreGround(const GuidedMap& map, const PlaceQuality& place,
                            const std::vector<SurfaceSample>& samples);

}  // namespace skein
