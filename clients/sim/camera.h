// COLMAP's SIMPLE_RADIAL camera with its principal point in the middle of the photo: x = f u (1 + k
// r^2) + width / 2. The centre of the upper left pixel is (0.5, 0.5).
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <vector>

namespace skein::sim {

struct Camera {
  int width = 1280;
  int height = 960;
  double focal_px = 1100;
  double distortion = -0.05;
};

// Camera frame: x right, y down, z forward.
struct Pose {
  Eigen::Quaterniond cam_from_world = Eigen::Quaterniond::Identity();
  Eigen::Vector3d center = Eigen::Vector3d::Zero();  // of projection, in the world

  Eigen::Vector3d Translation() const { return -(cam_from_world * center); }  // cam_from_world
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
