#pragma once

#include <Eigen/Core>

#include "sfm/ids.h"

namespace skein {

// Rotations as quaternions (w, x, y, z). A quaternion q != 0 stands for the rotation of q / |q|.
Eigen::Vector4d NormalizeQuaternion(const Eigen::Vector4d& qvec);
Eigen::Matrix3d QuaternionToRotationMatrix(const Eigen::Vector4d& qvec);
Eigen::Vector4d RotationMatrixToQuaternion(const Eigen::Matrix3d& R);
Eigen::Vector3d QuaternionRotatePoint(const Eigen::Vector4d& qvec, const Eigen::Vector3d& point);

// [v]x, so that [v]x u = v x u.
Eigen::Matrix3d CrossProductMatrix(const Eigen::Vector3d& v);

// [R | t]
Matrix3x4d ComposeProjectionMatrix(const Eigen::Vector4d& qvec, const Eigen::Vector3d& tvec);
Matrix3x4d ComposeProjectionMatrix(const Eigen::Matrix3d& R, const Eigen::Vector3d& t);

// The camera's centre -R' t, for the pose x_cam = R x_world + t.
Eigen::Vector3d ProjectionCenterFromPose(const Eigen::Vector4d& qvec, const Eigen::Vector3d& tvec);

}  // namespace skein
