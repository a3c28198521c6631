#pragma once

#include <cstdint>
#include <map>
#include <vector>

#include "mapping/adjuster.h"
#include "mapping/waiting_photos.h"

namespace skein {

// State of a submap that a checkpoint holds besides its COLMAP model.
struct SubmapState {
  std::vector<int64_t> photos;  // registered or waiting, in the order they came
  std::map<CameraId, bool> is_camera_refined;
  std::map<ImageId, TrialRecord> trials;
  Adjuster::Size size_at_global;
  ImageId first = 0;  // of the initial pair
};

}  // namespace skein
