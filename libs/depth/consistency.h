// Depths that depth maps of other photos confirm.
#pragma once

#include <vector>

#include "core/result.h"
#include "depth/depth_map.h"

namespace skein {

struct AgreementOptions {
  // A depth stays if this many other maps agree with it.
  int min_agreeing = 2;
  // Another map agrees if its depth at the point differs by at most this part, and its point lies
  // at most this far from the pixel.
  double max_depth_difference = 0.01;
  double max_reprojection_px = 1;

  Status Check() const;
};

// `map` without the depths that fewer than min_agreeing of `others` agree with. A depth that stays
// becomes the mean of its own and the agreeing ones, weighted by 1 / error^2; `error` is that of
// the mean, from the errors and from the spread of what was averaged. Throws std::invalid_argument
// for options that are not sound.
DepthMap KeepAgreed(const AgreementOptions& options, const DepthMap& map,
                    const std::vector<const DepthMap*>& others);

}  // namespace skein
