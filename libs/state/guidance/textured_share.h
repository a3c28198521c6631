// How much of a surfel has texture in the photos. Inside of libs/state/guidance.
#pragma once

#include <cstdint>
#include <vector>

#include "guidance/guided_map.h"
#include "guidance/quality.h"

namespace skein {

// Texture share of a square, 1.5 cells wide, centred on the surfel: the kMinSurfelPhotos-th
// largest over the photos, or the smallest if fewer photos see it. A photo whose texture is not
// known counts as textured.
class TexturedShare {
 public:
  // 0 without photos.
  double share() const { return best_.empty() ? 0 : best_.back(); }
  // photos: that were not added before. Surfel and cell are the same each time.
  void Add(const GuidedMap& map, const Surfel& surfel, double cell,
           const std::vector<uint32_t>& photos);

 private:
  std::vector<double> best_;  // of the photos, descending, at most kMinSurfelPhotos
};

}  // namespace skein
