#include "sfm/image.h"

#include <stdexcept>

#include "sfm/pose.h"

namespace skein {

Matrix3x4d Image::ProjectionMatrix() const { return ComposeProjectionMatrix(qvec_, tvec_); }

Eigen::Matrix3d Image::RotationMatrix() const { return QuaternionToRotationMatrix(qvec_); }

Eigen::Vector3d Image::ProjectionCenter() const { return ProjectionCenterFromPose(qvec_, tvec_); }

void Image::SetPoints2D(const std::vector<Eigen::Vector2d>& pixels) {
  if (!points2D_.empty()) throw std::logic_error("the image has its keypoints already");
  points2D_.reserve(pixels.size());
  for (const Eigen::Vector2d& pixel : pixels) points2D_.emplace_back(pixel);
}

void Image::SetPoint3DForPoint2D(Point2DIdx i, Point3DId id) {
  class Point2D& point2D = points2D_.at(i);
  if (!point2D.HasPoint3D()) ++num_points3D_;
  point2D.SetPoint3DId(id);
}

void Image::ResetPoint3DForPoint2D(Point2DIdx i) {
  class Point2D& point2D = points2D_.at(i);
  if (point2D.HasPoint3D()) --num_points3D_;
  point2D.SetPoint3DId(kInvalidPoint3DId);
}

}  // namespace skein
