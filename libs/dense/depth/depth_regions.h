// Parts of a photo that show depths of less range than all of it, for a search from coarse to fine.
#pragma once

#include <functional>
#include <opencv2/core.hpp>
#include <vector>

#include "depth/depth_map.h"

namespace skein {

struct DepthRegion {
  cv::Rect area;                      // of the photo's pixels
  std::vector<SweepPlanes> families;  // to be searched there
};

// Half the size. A pixel is valid if all that it covers is.
DepthPhoto Halved(const DepthPhoto& photo);

// The pixels of `area`, without a copy.
DepthPhoto Cropped(const DepthPhoto& photo, const cv::Rect& area);

// A quadtree over the photo. `coarse`: its map at a lower resolution. A region is searched by
// planes that are parallel to the one that most of its coarse depths lie on, from the nearest to
// the farthest of them, with a margin. Several planes, as of ground and wall, have a family each if
// these are at most kSweepLanes planes more. A region without enough coarse depths has `whole`.
// search_px: pixels by which planes move the pixels of an area in a neighbour. A region of more
// than `most_steps` planes a pixel apart is split in four, down to kMinRegionPx.
constexpr int kMinRegionPx = 80;
using RegionSearch = std::function<double(const cv::Rect& area, const SweepPlanes& planes)>;
std::vector<DepthRegion> RegionsOf(const DepthPhoto& photo, const DepthMap& coarse,
                                   const SweepPlanes& whole, double most_steps,
                                   const RegionSearch& search_px);

}  // namespace skein
