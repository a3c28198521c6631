#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <string>
#include <vector>

#include "sfm/ids.h"

namespace skein {

// A keypoint, and the point that it observes, if any.
class Point2D {
 public:
  Point2D() = default;
  explicit Point2D(const Eigen::Vector2d& xy) : xy_(xy) {}

  const Eigen::Vector2d& XY() const { return xy_; }  // in pixels
  double X() const { return xy_.x(); }
  double Y() const { return xy_.y(); }
  void SetXY(const Eigen::Vector2d& pixel) { xy_ = pixel; }

  skein::Point3DId Point3DId() const { return point3D_id_; }
  bool HasPoint3D() const { return point3D_id_ != kInvalidPoint3DId; }
  void SetPoint3DId(skein::Point3DId id) { point3D_id_ = id; }

 private:
  Eigen::Vector2d xy_ = Eigen::Vector2d::Zero();
  skein::Point3DId point3D_id_ = kInvalidPoint3DId;
};

// A photo: its camera, keypoints and pose. The pose is cam_from_world, x_cam = R x_world + t.
class Image {
 public:
  skein::ImageId ImageId() const { return image_id_; }
  void SetImageId(skein::ImageId id) { image_id_ = id; }
  skein::CameraId CameraId() const { return camera_id_; }
  void SetCameraId(skein::CameraId id) { camera_id_ = id; }
  const std::string& Name() const { return name_; }
  void SetName(const std::string& name) { name_ = name; }

  // A registered image has a pose that counts. Reconstruction sets it along with its list.
  bool IsRegistered() const { return is_registered_; }
  void SetRegistered(bool is_registered) { is_registered_ = is_registered; }

  const Eigen::Vector4d& Qvec() const { return qvec_; }  // w, x, y, z; not always of norm 1
  double Qvec(size_t i) const { return qvec_[static_cast<Eigen::Index>(i)]; }
  void SetQvec(const Eigen::Vector4d& qvec_wxyz) { qvec_ = qvec_wxyz; }
  const Eigen::Vector3d& Tvec() const { return tvec_; }
  double Tvec(size_t axis) const { return tvec_[static_cast<Eigen::Index>(axis)]; }
  void SetTvec(const Eigen::Vector3d& tvec) { tvec_ = tvec; }

  Matrix3x4d ProjectionMatrix() const;  // [R | t]
  Eigen::Matrix3d RotationMatrix() const;
  Eigen::Vector3d ProjectionCenter() const;  // in the world

  size_t NumPoints2D() const { return points2D_.size(); }
  size_t NumPoints3D() const { return num_points3D_; }  // keypoints that observe a point
  const std::vector<class Point2D>& Points2D() const { return points2D_; }
  // Throws std::out_of_range.
  const class Point2D& Point2D(Point2DIdx i) const { return points2D_.at(i); }
  class Point2D& Point2D(Point2DIdx i) {
    return points2D_.at(i);
  }
  // Throws std::logic_error if the image has keypoints already.
  void SetPoints2D(const std::vector<Eigen::Vector2d>& pixels);

  void SetPoint3DForPoint2D(Point2DIdx i, Point3DId id);
  void ResetPoint3DForPoint2D(Point2DIdx i);

 private:
  skein::ImageId image_id_ = kInvalidImageId;
  skein::CameraId camera_id_ = kInvalidCameraId;
  std::string name_;
  bool is_registered_ = false;
  size_t num_points3D_ = 0;
  Eigen::Vector4d qvec_{1, 0, 0, 0};
  Eigen::Vector3d tvec_{0, 0, 0};
  std::vector<class Point2D> points2D_;
};

}  // namespace skein
