#pragma once

#include <vector>

#include "sfm/ids.h"

namespace skein {

// Two keypoints of two images that show the same spot.
struct FeatureMatch {
  FeatureMatch() = default;
  FeatureMatch(Point2DIdx index1, Point2DIdx index2) : point2D_idx1(index1), point2D_idx2(index2) {}

  Point2DIdx point2D_idx1 = kInvalidPoint2DIdx;
  Point2DIdx point2D_idx2 = kInvalidPoint2DIdx;
};

using FeatureMatches = std::vector<FeatureMatch>;

}  // namespace skein
