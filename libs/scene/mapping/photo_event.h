#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>

#include "mapping/refusal.h"

namespace skein {

// A photo was registered, deferred, rejected or withdrawn.
struct PhotoEvent {
  enum class State { kRegistered, kDeferred, kRejected, kWithdrawn };
  int64_t image_id = 0;
  State state = State::kDeferred;
  Refusal refusal;  // of all but kRegistered
  int num_visible = 0;
  int num_inliers = 0;
  Eigen::Vector4d qvec{1, 0, 0, 0};  // cam_from_world, wxyz
  Eigen::Vector3d tvec{0, 0, 0};
  double mean_error_px = 0;  // of its observations after its BA
  int num_ba_images = 0;     // free images of its BA
  double register_s = 0, triangulate_s = 0, ba_s = 0, total_s = 0;
  double ba_cpu_s = 0;  // of the mapper's own thread
};

using EventSink = std::function<void(const PhotoEvent&)>;

}  // namespace skein
