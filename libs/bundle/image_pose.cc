#include "bundle/image_pose.h"

#include "base/pose.h"

namespace skein {

void GetPose(const colmap::Image& image, BundlePose* pose) {
  pose->image_id = image.ImageId();
  pose->R = colmap::QuaternionToRotationMatrix(image.Qvec());
  pose->t = image.Tvec();
}

void SetPose(const BundlePose& pose, colmap::Image* image) {
  image->SetQvec(colmap::RotationMatrixToQuaternion(pose.R));
  image->SetTvec(pose.t);
}

}  // namespace skein
