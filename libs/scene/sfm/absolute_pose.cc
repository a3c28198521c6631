#include "sfm/absolute_pose.h"

#include "sfm/colmap_api.h"
#include "sfm/pose.h"

namespace skein {

std::optional<AbsolutePose> EstimateAbsolutePose(const RansacLimits& limits,
                                                 const std::vector<Eigen::Vector2d>& pixels,
                                                 const std::vector<Eigen::Vector3d>& points,
                                                 const Camera& camera) {
  colmap::AbsolutePoseEstimationOptions options;
  options.num_threads = 1;
  options.ransac_options = colmap_api::ToColmap(limits);
  colmap_api::Pose found;
  size_t num_inliers = 0;
  std::vector<char> inlier_mask;
  if (!colmap_api::EstimatePose(options, pixels, points, camera, &found, &num_inliers,
                                &inlier_mask)) {
    return std::nullopt;
  }
  return AbsolutePose{QuaternionToRotationMatrix(found.qvec), found.tvec};
}

}  // namespace skein
