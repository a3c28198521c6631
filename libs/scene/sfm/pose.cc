#include "sfm/pose.h"

#include <Eigen/Geometry>

namespace skein {
namespace {

Eigen::Quaterniond ToQuaternion(const Eigen::Vector4d& qvec) {
  const Eigen::Vector4d q = NormalizeQuaternion(qvec);
  return Eigen::Quaterniond(q[0], q[1], q[2], q[3]);
}

}  // namespace

// Without a norm the real part is 1, so that (0, 0, 0, 0) is no rotation.
Eigen::Vector4d NormalizeQuaternion(const Eigen::Vector4d& qvec) {
  const double norm = qvec.norm();
  if (norm == 0) return Eigen::Vector4d(1, qvec[1], qvec[2], qvec[3]);
  return qvec / norm;
}

Eigen::Matrix3d QuaternionToRotationMatrix(const Eigen::Vector4d& qvec) {
  return ToQuaternion(qvec).toRotationMatrix();
}

Eigen::Vector4d RotationMatrixToQuaternion(const Eigen::Matrix3d& R) {
  const Eigen::Quaterniond q(R);
  return Eigen::Vector4d(q.w(), q.x(), q.y(), q.z());
}

Eigen::Vector3d QuaternionRotatePoint(const Eigen::Vector4d& qvec, const Eigen::Vector3d& point) {
  return ToQuaternion(qvec) * point;
}

Eigen::Matrix3d CrossProductMatrix(const Eigen::Vector3d& v) {
  Eigen::Matrix3d matrix;
  matrix << 0, -v[2], v[1], v[2], 0, -v[0], -v[1], v[0], 0;
  return matrix;
}

Matrix3x4d ComposeProjectionMatrix(const Eigen::Matrix3d& R, const Eigen::Vector3d& t) {
  Matrix3x4d matrix;
  matrix.leftCols<3>() = R;
  matrix.rightCols<1>() = t;
  return matrix;
}

Matrix3x4d ComposeProjectionMatrix(const Eigen::Vector4d& qvec, const Eigen::Vector3d& tvec) {
  return ComposeProjectionMatrix(QuaternionToRotationMatrix(qvec), tvec);
}

Eigen::Vector3d ProjectionCenterFromPose(const Eigen::Vector4d& qvec, const Eigen::Vector3d& tvec) {
  return ToQuaternion(qvec).conjugate() * -tvec;
}

}  // namespace skein
