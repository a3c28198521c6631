// Depth maps of photos with known poses: what goes in and what comes out.
//
// Pixels: the centre of the upper left pixel is (0.5, 0.5). Camera frame: x right, y down, z
// forward. Lengths are in the unit of the map that the poses are of. A bundle adjustment or a merge
// changes poses alone, so a depth map, which is in its camera's frame, stays valid; a change of
// the map's scale multiplies `depth` and `error`.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <functional>
#include <opencv2/core.hpp>
#include <vector>

namespace skein {

// A camera without distortion.
struct DepthCamera {
  int width = 0, height = 0;
  Eigen::Vector2d focal_px = Eigen::Vector2d::Zero();  // in x and in y
  Eigen::Vector2d principal_point_px = Eigen::Vector2d::Zero();

  // x / z and y / z of what the pixel shows.
  Eigen::Vector2d Ray(const Eigen::Vector2d& pixel) const {
    return (pixel - principal_point_px).cwiseQuotient(focal_px);
  }
  Eigen::Vector2d Pixel(const Eigen::Vector2d& ray) const {
    return ray.cwiseProduct(focal_px) + principal_point_px;
  }
  // Calibration matrix of OpenCV's pixels: the centre of the upper left one is (0, 0).
  Eigen::Matrix3d CalibrationOfIndices() const {
    Eigen::Matrix3d k = Eigen::Matrix3d::Identity();
    k.diagonal().head<2>() = focal_px;
    k.topRightCorner<2, 1>() = principal_point_px.array() - 0.5;
    return k;
  }
};

// x_camera = rotation * x_world + translation.
struct DepthPose {
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();

  Eigen::Vector3d Centre() const { return -rotation.transpose() * translation; }
  Eigen::Vector3d ToCamera(const Eigen::Vector3d& in_world) const {
    return rotation * in_world + translation;
  }
  Eigen::Vector3d ToWorld(const Eigen::Vector3d& in_camera) const {
    return rotation.transpose() * (in_camera - translation);
  }
};

// A photo freed of its distortion (photo_table.h), at the size of its depth map.
struct DepthPhoto {
  cv::Mat1b grey;   // height x width
  cv::Mat1b valid;  // height x width: 0 where the camera's photo shows nothing; empty: all valid
  DepthCamera camera;
  DepthPose cam_from_world;
};

// Whether all numbers are finite, and the pixels have the camera's size.
bool IsSound(const DepthPhoto& photo);

// The depths at which the surface is searched, 0 < near < far.
struct DepthRange {
  double near = 0, far = 0;
  // Planes of space that the surface may lie on: inverse depth = plane . (DepthCamera::Ray, 1).
  std::vector<Eigen::Vector3d> planes = {};
};

// Planes whose inverse depth at a ray (DepthCamera::Ray) is `plane` + slope . (ray - centre), from
// plane = `first` to `last`. Inverse depths are a plane's linear function of the ray.
struct SweepPlanes {
  double first = 0, last = 0;
  Eigen::Vector2d slope = Eigen::Vector2d::Zero(), centre = Eigen::Vector2d::Zero();

  double Middle() const { return (first + last) / 2; }
  // The inverse depth at a ray is this times (ray, 1).
  Eigen::Vector3d Normal(double plane) const {
    return {slope.x(), slope.y(), plane - slope.dot(centre)};
  }
  double InverseDepth(const Eigen::Vector2d& ray, double plane) const {
    return plane + slope.dot(ray - centre);
  }
};

struct DepthMap {
  DepthCamera camera;
  DepthPose cam_from_world;
  // height x width. z in the camera's frame; 0 is a hole.
  cv::Mat1f depth;
  // height x width. Predicted standard error of `depth`; 0 at holes.
  cv::Mat1f error;

  // The point at a pixel's depth, in the camera's frame.
  Eigen::Vector3d Point(int x, int y) const {
    return depth(y, x) * camera.Ray({x + 0.5, y + 0.5}).homogeneous();
  }

  // Makes holes of the pixels at which `where`, height x width, is not 0.
  void MakeHoles(const cv::Mat1b& where);

  // Share of pixels that have a depth.
  double Completeness() const;
  double MedianDepth() const;  // 0 without depths
};

// The map of a photo before any depth is known.
DepthMap HolesOf(const DepthPhoto& photo);

// Asked between parts of a few milliseconds; true: stop. Empty: go on to the end.
using DepthStop = std::function<bool()>;

}  // namespace skein
