// A depth map that other photos confirm, as the mesh takes it.
#pragma once

#include <cstdint>
#include <opencv2/core.hpp>

#include "depth/depth_map.h"

namespace skein {

// A photo's confirmed depths. Pixels are shared and never change.
struct ConfirmedMap {
  DepthMap map;           // at its scale of now; without pixels where they were forgotten
  cv::Mat3b colours;      // of the map's pixels
  double scale = 1;       // of the depths, to those of when `revision` came
  uint64_t revision = 0;  // another one: other depths

  bool has_pixels() const { return !map.depth.empty() && colours.size() == map.depth.size(); }
};

// Pixels may be shared with a ConfirmedMap: those stay as they are.
inline void ScaleDepths(double scale, DepthMap* map) {
  for (cv::Mat1f* pixels : {&map->depth, &map->error}) {
    *pixels = pixels->clone();
    *pixels *= scale;
  }
}

}  // namespace skein
