#pragma once

#include <functional>
#include <memory>
#include <string>

#include "core/result.h"
#include "mapping/misplaced.h"
#include "mapping/registration.h"

namespace skein {

struct SubmapOptions {
  std::string camera_model = "auto";  // by evidence (camera_models.h), or one of COLMAP's
  int local_ba_images = 30;           // of a local BA, the new one included (local_adjustment.h)
  int max_images_all_global = 12;     // up to here each photo's BA takes in the whole map
  double global_growth = 1.1;         // growth of images or points that calls for a global BA
  // Part of the matches that agree with a map which the same photos, mapped again, must win for
  // that map to stay. If the map cannot win so many, nothing is mapped again.
  double min_rebuild_gain = 0.005;
  // Global BA beside registration, in a thread of its own. Off: in turn with it, and the result
  // depends only on the order of the calls.
  bool background = false;
  int num_threads = 1;
  // Asked between the parts of Consolidate and Finish, and between the steps of a global BA there:
  // true ends them with the map as it is. Null: they go on to their end.
  std::function<bool()> stop;

  // Parts of a job that may fail without failing the job.
  enum class Part { kPhoto, kMaintenance };
  // Called when a part begins; the returned object lives until the part has ended. `image_id`: of
  // kPhoto. Null: no call.
  std::function<std::shared_ptr<void>(Part part, int64_t image_id)> enter;

  std::shared_ptr<void> Enter(Part part, int64_t image_id = 0) const {
    return enter ? enter(part, image_id) : nullptr;
  }
  bool IsStopped() const { return stop && stop(); }
  Status Check() const;
};

}  // namespace skein
