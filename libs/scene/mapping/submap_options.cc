#include "mapping/submap_options.h"

#include "core/option_check.h"
#include "mapping/camera_models.h"
#include "sfm/camera.h"

namespace skein {
namespace {

Status CheckCameraModel(const std::string& name) {
  if (name == kModelByEvidence || ExistsCameraModel(name)) return Status::Ok();
  return InvalidArgument("camera_model is \"" + name +
                         "\": give auto, or one of COLMAP's, as SIMPLE_RADIAL or OPENCV");
}

}  // namespace

Status SubmapOptions::Check() const {
  return FirstError({CheckCameraModel(camera_model),
                     InRange("local_ba_images", local_ba_images, 3, 1000),
                     InRange("max_images_all_global", max_images_all_global, 0, 1'000'000),
                     InRange("global_growth", global_growth, 1.001, 1000.0),
                     InRange("min_rebuild_gain", min_rebuild_gain, 0.0, 1.0),
                     InRange("num_threads", num_threads, 1, 1024)});
}

}  // namespace skein
