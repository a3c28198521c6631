#include "map/image_pose.h"

#include <utility>

#include "core/limits.h"
#include "sfm/pose.h"

namespace skein {
namespace {

bool IsAstray(const BundleCamera& refined, const Reconstruction& model) {
  if (refined.refined.empty()) return false;
  Camera camera = model.Camera(refined.camera_id);
  camera.SetParams(refined.params);
  return !HasPossibleIntrinsics(camera);
}

}  // namespace

void GetPose(const Image& image, BundlePose* pose) {
  pose->image_id = image.ImageId();
  pose->R = QuaternionToRotationMatrix(image.Qvec());
  pose->t = image.Tvec();
}

void SetPose(const BundlePose& pose, Image* image) {
  image->SetQvec(RotationMatrixToQuaternion(pose.R));
  image->SetTvec(pose.t);
}

bool IsRegisteredIn(const Reconstruction& model, ImageId id) {
  return model.ExistsImage(id) && model.IsImageRegistered(id);
}

bool HasPossibleIntrinsics(const Camera& camera) {
  return !camera.HasBogusParams(limits::kMinFocalRatio, limits::kMaxFocalRatio,
                                limits::kMaxDistortion);
}

void ApplyBundle(const Bundle& bundle, Reconstruction* model) {
  for (const BundlePose& pose : bundle.poses) {
    if (!pose.constant && IsRegisteredIn(*model, pose.image_id))
      SetPose(pose, &model->Image(pose.image_id));
  }
  for (const BundlePoint& point : bundle.points) {
    if (point.constant || !model->ExistsPoint3D(point.point3D_id)) continue;
    model->Point3D(point.point3D_id).SetXYZ(point.xyz);
  }
  for (const BundleCamera& camera : bundle.cameras) {
    if (camera.refined.empty()) continue;
    Camera& now = model->Camera(camera.camera_id);
    if (now.ModelId() == camera.model_id) now.SetParams(camera.params);
  }
}

BundleSummary SolveWithPossibleIntrinsics(const BundleOptions& options, const Reconstruction& model,
                                          Bundle* bundle) {
  for (;;) {
    Bundle refined = *bundle;
    const BundleSummary summary = SolveBundle(options, &refined);
    bool is_any_astray = false;
    for (size_t i = 0; summary.usable && i < refined.cameras.size(); ++i) {
      if (!IsAstray(refined.cameras[i], model)) continue;
      bundle->cameras[i].refined.clear();
      is_any_astray = true;
    }
    if (is_any_astray) continue;
    if (summary.usable) *bundle = std::move(refined);
    return summary;
  }
}

}  // namespace skein
