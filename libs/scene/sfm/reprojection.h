#pragma once

#include <Eigen/Core>

#include "sfm/camera.h"
#include "sfm/ids.h"

namespace skein {

// Errors of a point in an image whose pose is cam_from_world. Squared errors are in pixels^2; a
// point that is not in front of the camera has the largest double.
double CalculateSquaredReprojectionError(const Eigen::Vector2d& pixel, const Eigen::Vector3d& point,
                                         const Eigen::Vector4d& qvec, const Eigen::Vector3d& tvec,
                                         const Camera& camera);
double CalculateSquaredReprojectionError(const Eigen::Vector2d& pixel, const Eigen::Vector3d& point,
                                         const Matrix3x4d& cam_from_world, const Camera& camera);

// Angles in radians between a keypoint's ray and the point's.
double CalculateAngularError(const Eigen::Vector2d& pixel, const Eigen::Vector3d& point,
                             const Matrix3x4d& cam_from_world, const Camera& camera);
double CalculateAngularError(const Eigen::Vector2d& pixel, const Eigen::Vector3d& point,
                             const Eigen::Vector4d& qvec, const Eigen::Vector3d& tvec,
                             const Camera& camera);
// The keypoint on the plane at depth 1.
double CalculateNormalizedAngularError(const Eigen::Vector2d& on_plane,
                                       const Eigen::Vector3d& point,
                                       const Matrix3x4d& cam_from_world);

bool HasPointPositiveDepth(const Matrix3x4d& cam_from_world, const Eigen::Vector3d& point);

}  // namespace skein
