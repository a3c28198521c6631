// Depths that depth maps of other photos confirm.
#pragma once

#include <opencv2/core.hpp>
#include <vector>

#include "depth/depth_map.h"

namespace skein {

// A depth stays if so many other maps agree with it (agreement.h).
constexpr int kMinAgreeing = 2;
// A depth is contradicted if so many other maps see past it (agreement.h), and fewer agree.
constexpr int kMinContradicting = 3;

// `map` without the depths that fewer of `others` agree with. A depth that stays becomes the mean
// of its own and the agreeing ones, weighted by 1 / error^2; `error` is that of the mean, from the
// errors and from the spread of what was averaged.
DepthMap KeepAgreed(const DepthMap& map, const std::vector<const DepthMap*>& others);

// 0 where a depth of `map` is contradicted, as that of a thing that moved between the photos. 255
// elsewhere, also at holes. `agreed`: KeepAgreed of each of `others`. A map counts as one that sees
// past a depth only where the map's own depth behind it is agreed.
cv::Mat1b StaticMask(const DepthMap& map, const std::vector<const DepthMap*>& others,
                     const std::vector<const DepthMap*>& agreed);

}  // namespace skein
