#include "sfm/track.h"

#include <algorithm>

namespace skein {

bool Track::HasImage(ImageId image_id) const {
  return std::any_of(elements_.begin(), elements_.end(),
                     [&](const TrackElement& element) { return element.image_id == image_id; });
}

void Track::DeleteElement(ImageId image_id, Point2DIdx index) {
  const auto is_it = [&](const TrackElement& element) {
    return element.image_id == image_id && element.point2D_idx == index;
  };
  elements_.erase(std::remove_if(elements_.begin(), elements_.end(), is_it), elements_.end());
}

}  // namespace skein
