#pragma once

#include <Eigen/Core>
#include <vector>

namespace skein {

// Largest number of parameters of a COLMAP camera model (FULL_OPENCV, THIN_PRISM_FISHEYE).
constexpr int kMaxIntrinsics = 12;

using IntrinsicsJacobian = Eigen::Matrix<double, 2, kMaxIntrinsics>;

// Projects a point in the camera's frame (x right, y down, z forward) with a COLMAP camera model.
// Output in pixels; the centre of the upper-left pixel is (0.5, 0.5).
//   J_point       2 x 3, d pixel / d point_in_cam
//   J_intrinsics  2 x number of parameters (left columns), d pixel / d params; null: not wanted
// Returns false when the point does not lie in front of the camera; the outputs are then unset.
// SIMPLE_RADIAL, SIMPLE_PINHOLE and OPENCV have derivatives by hand (5 times as fast). The others
// use automatic differentiation of COLMAP's camera models (colmap_api.h). Throws
// std::invalid_argument for a model that projection.cc does not list.
bool ProjectWithJacobians(int model_id, const std::vector<double>& params,
                          const Eigen::Vector3d& point_in_cam, Eigen::Vector2d* pixel,
                          Eigen::Matrix<double, 2, 3>* J_point, IntrinsicsJacobian* J_intrinsics);

// The same without derivatives.
bool Project(int model_id, const std::vector<double>& params, const Eigen::Vector3d& point_in_cam,
             Eigen::Vector2d* pixel);

}  // namespace skein
