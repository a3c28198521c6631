// Photos freed of their lens distortion, at the size of a depth map.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <opencv2/core.hpp>
#include <optional>

#include "depth/depth_map.h"

namespace skein {

// A camera as it is: any lens. The projection maps x / z and y / z of a point in front of the
// camera to its pixel in the photo of width x height. nullopt: it shows no such point.
struct LensCamera {
  int width = 0, height = 0;
  Eigen::Vector2d focal_px = Eigen::Vector2d::Zero();
  Eigen::Vector2d principal_point_px = Eigen::Vector2d::Zero();
  std::function<std::optional<Eigen::Vector2d>(const Eigen::Vector2d& ray)> project;
};

// Positions of a depth map's pixels in its photo. One table serves all photos of a camera.
class PhotoTable {
 public:
  // The pinhole camera has the photo's focal length and principal point, scaled so that its longer
  // side is `longer_side_px`, or the photo's where that is less. Throws std::invalid_argument for a
  // size or focal length that is not positive.
  PhotoTable(const LensCamera& lens, int longer_side_px);

  // The pinhole camera of such a table. Throws as the constructor.
  static DepthCamera CameraOf(const LensCamera& lens, int longer_side_px);

  const DepthCamera& camera() const { return camera_; }
  // height x width: DepthPhoto's `valid`.
  const cv::Mat1b& valid() const { return valid_; }

  // `photo`: of the lens camera's size, or its sides divided by a whole number, rounded up, as a
  // decoder reduces it. Areas are averaged first, so that nothing aliases. Throws
  // std::invalid_argument for another size.
  DepthPhoto Apply(const cv::Mat1b& photo, const DepthPose& cam_from_world) const;
  cv::Mat3b Apply(const cv::Mat3b& photo) const;

 private:
  // Valid stays what is around the principal point, up to where the orientation changes.
  void KeepFirstSight();
  bool KeepsOrientation(int u, int v) const;  // of the table around a pixel and those before it
  bool IsOfCamera(cv::Size photo) const;
  cv::Mat Undistort(const cv::Mat& photo) const;

  int photo_width_, photo_height_;
  DepthCamera camera_;
  cv::Mat1f x_, y_;  // in the photo shrunk to the depth map's size, its first centre at (0, 0)
  cv::Mat1b valid_;
};

}  // namespace skein
