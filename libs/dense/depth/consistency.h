// Depths that depth maps of other photos confirm.
#pragma once

#include <opencv2/core.hpp>
#include <vector>

#include "depth/depth_map.h"

namespace skein {

// A depth stays if a map agrees with it (agreement.h), and more than one on the mean over a patch
// around it. So many count of a pixel, at most: a surface is seen whole, chance agrees here and
// there.
constexpr int kMinAgreeing = 2;
constexpr int kAgreementPatch = 5;  // pixels
// A depth is contradicted if so many other maps see past it (agreement.h), and fewer agree.
constexpr int kMinContradicting = 3;

// `map` without the depths that too few of `others` agree with. A depth that stays becomes the mean
// of its own and the agreeing ones, weighted by 1 / error^2. `error` is that of the mean, from the
// errors and from the spread of what was averaged. An edge of depth, where other maps see past the
// patch, adds an error between the spread of what agrees and the height of the edge.
DepthMap KeepAgreed(const DepthMap& map, const std::vector<const DepthMap*>& others);

// 0 where a depth of `map` is contradicted, as that of a thing that moved between the photos. 255
// elsewhere, also at holes. `agreed`: KeepAgreed of each of `others`. A map counts as one that sees
// past a depth only where the map's own depth behind it is agreed.
cv::Mat1b StaticMask(const DepthMap& map, const std::vector<const DepthMap*>& others,
                     const std::vector<const DepthMap*>& agreed);

}  // namespace skein
