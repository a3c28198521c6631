// Depths that depth maps of other photos confirm.
#pragma once

#include <vector>

#include "depth/depth_map.h"

namespace skein {

// A depth stays if so many other maps agree with it (agreement.h).
constexpr int kMinAgreeing = 2;

// `map` without the depths that fewer of `others` agree with. A depth that stays becomes the mean
// of its own and the agreeing ones, weighted by 1 / error^2; `error` is that of the mean, from the
// errors and from the spread of what was averaged.
DepthMap KeepAgreed(const DepthMap& map, const std::vector<const DepthMap*>& others);

}  // namespace skein
