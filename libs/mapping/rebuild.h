#pragma once

#include <cstdint>
#include <memory>

#include "mapping/submap.h"

namespace skein {

// A submap of the same photos and matches, mapped anew as if all photos had come at once. It begins
// with the best pair of `first`; photos that see most points follow. Photos that are not registered
// and match a visually similar place are left out. Null if `first` has no pair to start from.
std::unique_ptr<Submap> MapAnew(const Submap& submap, ImageId first);

// Verified matches between registered photos that agree with their poses.
int64_t CountAgreeingMatches(const SceneMap& map, double max_epipolar_error_px);

}  // namespace skein
