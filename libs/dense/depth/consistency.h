// Depths that depth maps of other photos confirm.
#pragma once

#include <vector>

#include "depth/depth_map.h"
#include "depth/depth_quality.h"

namespace skein {

// A depth stays if so many other maps agree with it (agreement.h).
constexpr int kMinAgreeing = 2;
// A depth that does not stay is contradicted if so many other maps see past it (agreement.h).
constexpr int kMinContradicting = 2;

// `map` without the depths that fewer of `others` agree with. A depth that stays becomes the mean
// of its own and the agreeing ones, weighted by 1 / error^2; `error` is that of the mean, from the
// errors and from the spread of what was averaged. counts: of the depths of `map`; nullptr: not
// counted.
DepthMap KeepAgreed(const DepthMap& map, const std::vector<const DepthMap*>& others,
                    DepthCounts* counts = nullptr);

}  // namespace skein
