// COLMAP's SIMPLE_RADIAL camera: x = f u (1 + k r^2) + c. The centre of the upper left pixel is
// (0.5, 0.5).
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <opencv2/core.hpp>
#include <vector>

#include "core/angles.h"

namespace skein::sim {

constexpr double kDegree = DegToRad(1);

struct Camera {
  int width = 1280;
  int height = 960;
  double focal_px = 1100;
  double distortion = -0.05;
  Eigen::Vector2d center_offset_px = Eigen::Vector2d::Zero();  // principal point from the middle

  Eigen::Vector2d PrincipalPoint() const {
    return Eigen::Vector2d(width, height) / 2 + center_offset_px;
  }
};

// The camera of the part `box` of a photo. The part's principal point is off its middle.
Camera Crop(const Camera& camera, const cv::Rect& box);

// Camera frame: x right, y down, z forward.
struct Pose {
  Eigen::Quaterniond cam_from_world = Eigen::Quaterniond::Identity();
  Eigen::Vector3d center = Eigen::Vector3d::Zero();  // of projection, in the world

  Eigen::Vector3d Translation() const { return -(cam_from_world * center); }  // cam_from_world
};

// Motion of a camera, constant for the time of one photo.
struct Motion {
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();          // of the centre, world, m/s
  Eigen::Vector3d angular_velocity = Eigen::Vector3d::Zero();  // of the camera, its frame, rad/s
};

Pose PoseAfter(const Pose& pose, const Motion& motion, double seconds);
// The motion that leads from `from` to `to` in `seconds`.
Motion MotionBetween(const Pose& from, const Pose& to, double seconds);

struct Shutter {
  double exposure_s = 0;  // of each row
  double readout_s = 0;   // from the first row to the end of the last: a rolling shutter

  // From the middle of the photo's exposure to that of the row at `y_px`.
  double RowDelay(double y_px, int height) const { return readout_s * (y_px / height - 0.5); }
};

// Looks from `center` towards `target`, the world's z up; `roll_rad` turns about the view axis.
Pose LookAt(const Eigen::Vector3d& center, const Eigen::Vector3d& target, double roll_rad);

// False: behind the camera or outside the photo.
bool Project(const Camera& camera, const Pose& pose, const Eigen::Vector3d& world,
             Eigen::Vector2d* pixel);

// Pixel to normalised, undistorted coordinates, from a table of radii (error below 1e-4 px).
class Undistorter {
 public:
  explicit Undistorter(const Camera& camera);
  Eigen::Vector2f operator()(float x_px, float y_px) const;

 private:
  float center_x_, center_y_, inverse_focal_, entries_per_unit_;
  std::vector<float> factor_;  // undistorted / distorted radius, over the squared distorted one
};

}  // namespace skein::sim
