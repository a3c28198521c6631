#include "sfm/absolute_pose.h"

#include "sfm/colmap_api.h"
#include "sfm/pose.h"

namespace skein {

bool EstimateAbsolutePose(const RansacLimits& limits, const std::vector<Eigen::Vector2d>& pixels,
                          const std::vector<Eigen::Vector3d>& points, const Camera& camera,
                          AbsolutePose* pose, std::vector<char>* inlier_mask) {
  colmap::AbsolutePoseEstimationOptions options;
  options.num_threads = 1;
  options.ransac_options = colmap_api::ToColmap(limits);
  colmap_api::Pose found;
  if (!colmap_api::EstimatePose(options, pixels, points, camera, &found, &pose->num_inliers,
                                inlier_mask)) {
    return false;
  }
  pose->R = QuaternionToRotationMatrix(found.qvec);
  pose->t = found.tvec;
  return true;
}

}  // namespace skein
