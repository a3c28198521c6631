#include "depth/agreement.h"

#include <Eigen/LU>
#include <algorithm>
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

std::optional<Agreement::Projection> Agreement::Project(int x, int y, float depth) const {
  const Eigen::Vector3f there = there_.Apply(static_cast<float>(x), static_cast<float>(y), depth);
  if (!(there.z() > 0)) return std::nullopt;
  const float u = there.x() / there.z(), v = there.y() / there.z();
  const cv::Size size = other_.depth.size();
  if (!(u > -0.5f && v > -0.5f && u + 0.5f < size.width && v + 0.5f < size.height)) {
    return std::nullopt;
  }
  return Projection{u, v, static_cast<int>(u + 0.5f), static_cast<int>(v + 0.5f), there.z()};
}

std::optional<DepthEstimate> Agreement::Find(int x, int y, float depth, float* behind) const {
  if (behind != nullptr) *behind = 0;
  const std::optional<Projection> there = Project(x, y, depth);
  if (!there) return std::nullopt;
  const std::optional<DepthEstimate> found = FindAt(x, y, *there);
  if (!found && behind != nullptr) {
    *behind = std::max(0.0f, other_.depth(there->row, there->column) / there->depth - 1);
  }
  return found;
}

std::optional<DepthEstimate> Agreement::FindAt(int x, int y, const Projection& there) const {
  const float other_depth = other_.depth(there.row, there.column);
  if (!(std::abs(other_depth - there.depth) <= kMaxDepthDifference * there.depth)) {
    return std::nullopt;
  }
  const float column = static_cast<float>(x), row = static_cast<float>(y);
  const Eigen::Vector3f back = back_.Apply(there.u, there.v, other_depth);
  const float du = back.x() - column * back.z(), dv = back.y() - row * back.z();
  const float most = kMaxReprojectionPx * back.z();
  if (!(back.z() > 0 && du * du + dv * dv <= most * most)) return std::nullopt;
  return DepthEstimate{back.z(), other_.error(there.row, there.column) * back.z() / other_depth};
}

bool Agreement::IsBehind(int row, int column, float depth, float error) const {
  const float difference = other_.depth(row, column) - depth;
  if (!(difference > kMaxDepthDifference * depth)) return false;
  const float other_error = other_.error(row, column);
  const float variance = error * error + other_error * other_error;
  return difference * difference > kSeesPastErrors * kSeesPastErrors * variance;
}

bool Agreement::SeesPast(int x, int y, float depth, float error) const {
  const std::optional<Projection> there = Project(x, y, depth);
  if (!there || !IsBehind(there->row, there->column, there->depth, error)) return false;
  constexpr int kReach = static_cast<int>(kMaxReprojectionPx);
  const cv::Rect near =
      cv::Rect(there->column - kReach, there->row - kReach, 2 * kReach + 1, 2 * kReach + 1) &
      cv::Rect(cv::Point(), other_.depth.size());
  for (int row = near.y; row < near.br().y; ++row) {
    for (int column = near.x; column < near.br().x; ++column) {
      const float other_depth = other_.depth(row, column);
      if (other_depth > 0 && !IsBehind(row, column, there->depth, error)) return false;
    }
  }
  return true;
}

std::vector<Agreement> AgreementsOf(const DepthMap& map,
                                    const std::vector<const DepthMap*>& others) {
  std::vector<Agreement> agreements;
  for (const DepthMap* other : others) agreements.emplace_back(map, *other);
  return agreements;
}

}  // namespace skein
