// How much of a surfel has texture in the photos. Inside of libs/guidance.
#pragma once

#include <cstdint>
#include <vector>

#include "guidance/guided_map.h"
#include "guidance/surface.h"

namespace skein {

// Of a square of 1.5 cells around the surfel, in the photo in which that is the min_photos-th
// largest, or the least of fewer. A photo whose texture is not known counts as textured.
class TexturedShare {
 public:
  // 0 without photos.
  double share() const { return best_.empty() ? 0 : best_.back(); }
  // photos: that were not added before. Surfel, cell and min_photos are the same each time.
  void Add(const GuidedMap& map, const Surfel& surfel, double cell, int min_photos,
           const std::vector<uint32_t>& photos);

 private:
  std::vector<double> best_;  // of the photos, descending, at most min_photos
};

}  // namespace skein
