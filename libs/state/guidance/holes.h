// Holes in what a map knows of its photos: bare paint, thin legs, all that has no points.
#pragma once

#include <array>
#include <vector>

#include "guidance/guided_map.h"

namespace skein {

// Share of holes in what the photos of a map that changes show, in squares a tenth of a photo wide.
// A square without a point of its own photo is a hole if the photo has points above it and on two
// of its other sides: neither the sky nor a background without points is a hole. Points that other
// photos observe do not fill it, as they may lie behind bare paint. 0 without points.
class Holes {
 public:
  // changed: by photo, whether it is new or has moved, or observes other points. Costs the
  // observations of these, and a look at the others.
  double Update(const GuidedMap& map, const std::vector<bool>& changed);

 private:
  struct OfPhoto {
    std::array<int, 2> upwards{};            // from square to square, columns and rows
    int num_with_points = 0, num_holes = 0;  // squares
  };

  std::vector<OfPhoto> photos_;
};

}  // namespace skein
