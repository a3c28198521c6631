#include "clients/places/camera.h"

#include <cmath>

namespace skein::sim {
namespace {

constexpr int kTableSize = 8192;

// Solves radius_distorted = r (1 + k r^2) for r by Newton's method; returns r / radius_distorted.
double UndistortionFactor(double radius_distorted, double k) {
  if (radius_distorted < 1e-9) return 1;
  double r = radius_distorted;
  for (int i = 0; i < 20; ++i) {
    r -= (r * (1 + k * r * r) - radius_distorted) / (1 + 3 * k * r * r);
  }
  return r / radius_distorted;
}

}  // namespace

Camera Crop(const Camera& camera, const cv::Rect& box) {
  Camera part = camera;
  part.width = box.width;
  part.height = box.height;
  part.center_offset_px = camera.PrincipalPoint() - Eigen::Vector2d(box.x, box.y) -
                          Eigen::Vector2d(box.width, box.height) / 2;
  return part;
}

Pose PoseAfter(const Pose& pose, const Motion& motion, double seconds) {
  const Eigen::Vector3d turn = seconds * motion.angular_velocity;
  const Eigen::Vector3d center = pose.center + seconds * motion.velocity;
  if (turn.isZero(0)) return {pose.cam_from_world, center};
  // The world turns the other way.
  const Eigen::AngleAxisd rotation(-turn.norm(), turn.normalized());
  return {(rotation * pose.cam_from_world).normalized(), center};
}

Motion MotionBetween(const Pose& from, const Pose& to, double seconds) {
  const Eigen::AngleAxisd turn(from.cam_from_world * to.cam_from_world.conjugate());
  return {(to.center - from.center) / seconds, turn.axis() * (turn.angle() / seconds)};
}

Pose LookAt(const Eigen::Vector3d& center, const Eigen::Vector3d& target, double roll_rad) {
  const Eigen::Vector3d forward = (target - center).normalized();
  const Eigen::Vector3d right = forward.cross(Eigen::Vector3d::UnitZ()).normalized();
  const Eigen::Vector3d down = forward.cross(right);
  Eigen::Matrix3d rotation;
  rotation << right.transpose(), down.transpose(), forward.transpose();
  const Eigen::AngleAxisd roll(roll_rad, Eigen::Vector3d::UnitZ());
  return {Eigen::Quaterniond(roll.toRotationMatrix() * rotation).normalized(), center};
}

bool Project(const Camera& camera, const Pose& pose, const Eigen::Vector3d& world,
             Eigen::Vector2d* pixel) {
  const Eigen::Vector3d local = pose.cam_from_world * (world - pose.center);
  if (local.z() <= 1e-6) return false;
  const Eigen::Vector2d uv = local.hnormalized();
  const double radial = 1 + camera.distortion * uv.squaredNorm();
  *pixel = camera.focal_px * radial * uv + camera.PrincipalPoint();
  return pixel->x() >= 0 && pixel->y() >= 0 && pixel->x() < camera.width &&
         pixel->y() < camera.height;
}

Undistorter::Undistorter(const Camera& camera)
    : center_x_(static_cast<float>(camera.PrincipalPoint().x())),
      center_y_(static_cast<float>(camera.PrincipalPoint().y())),
      inverse_focal_(static_cast<float>(1 / camera.focal_px)) {
  const Eigen::Vector2d reach =
      Eigen::Vector2d(camera.width, camera.height) / 2 + camera.center_offset_px.cwiseAbs();
  const double corner = reach.norm() / camera.focal_px * 1.01;
  const double max_r2 = corner * corner;
  entries_per_unit_ = static_cast<float>(kTableSize / max_r2);
  for (int i = 0; i < kTableSize + 2; ++i) {
    factor_.push_back(static_cast<float>(
        UndistortionFactor(std::sqrt(i * max_r2 / kTableSize), camera.distortion)));
  }
}

Eigen::Vector2f Undistorter::operator()(float x_px, float y_px) const {
  const Eigen::Vector2f distorted((x_px - center_x_) * inverse_focal_,
                                  (y_px - center_y_) * inverse_focal_);
  const float at = distorted.squaredNorm() * entries_per_unit_;
  const int i = static_cast<int>(at);
  const float fraction = at - static_cast<float>(i);
  return distorted * (factor_[i] + fraction * (factor_[i + 1] - factor_[i]));
}

}  // namespace skein::sim
