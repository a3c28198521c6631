#include "depth/agreement.h"

#include <Eigen/LU>
#include <cmath>

namespace skein {
Transfer::Transfer(const DepthMap& from, const DepthMap& to) {
  const Eigen::Matrix3d rotation =
      to.cam_from_world.rotation * from.cam_from_world.rotation.transpose();
  const Eigen::Vector3d translation =
      to.cam_from_world.translation - rotation * from.cam_from_world.translation;
  const Eigen::Matrix3d k = to.camera.CalibrationOfIndices();
  of_pixel_ = (k * rotation * from.camera.CalibrationOfIndices().inverse()).cast<float>();
  shift_ = (k * translation).cast<float>();
}

Agreement::Agreement(const DepthMap& map, const DepthMap& other)
    : other_(other), there_(map, other), back_(other, map) {}

std::optional<DepthEstimate> Agreement::Find(int x, int y, float depth) const {
  const float column = static_cast<float>(x), row = static_cast<float>(y);
  const Eigen::Vector3f there = there_.Apply(column, row, depth);
  if (!(there.z() > 0)) return std::nullopt;
  const float u = there.x() / there.z(), v = there.y() / there.z();
  const cv::Size size = other_.depth.size();
  if (!(u > -0.5f && v > -0.5f && u + 0.5f < size.width && v + 0.5f < size.height)) {
    return std::nullopt;
  }
  const int nearest_u = static_cast<int>(u + 0.5f), nearest_v = static_cast<int>(v + 0.5f);
  const float other_depth = other_.depth(nearest_v, nearest_u);
  if (!(std::abs(other_depth - there.z()) <= kMaxDepthDifference * there.z())) return std::nullopt;
  const Eigen::Vector3f back = back_.Apply(u, v, other_depth);
  const float du = back.x() - column * back.z(), dv = back.y() - row * back.z();
  const float most = kMaxReprojectionPx * back.z();
  if (!(back.z() > 0 && du * du + dv * dv <= most * most)) return std::nullopt;
  return DepthEstimate{back.z(), other_.error(nearest_v, nearest_u) * back.z() / other_depth};
}

}  // namespace skein
