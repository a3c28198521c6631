#pragma once

#include <vector>

#include "bundle/bundle.h"
#include "sfm/projection.h"

namespace skein {

// Row of each free pose (6 rows) and of each camera with refined parameters in the reduced system;
// -1: not in it.
struct BundleLayout {
  std::vector<int> pose_row;
  std::vector<int> camera_of_pose;
  std::vector<int> camera_row;
  std::vector<int> camera_size;  // refined parameters
  int num_free_poses = 0;
  int size = 0;
};

BundleLayout MakeLayout(const Bundle& bundle);

// Points [begin, end) of a bundle.
struct PointRange {
  int begin, end;
};

// Four parts with about as many observations each, for sums over the points in threads: always the
// same, so the sum does not depend on the number of threads. At least one, which may be empty.
std::vector<PointRange> SplitPoints(const Bundle& bundle);

// One observation, linearised and multiplied by the square root of its robust weight.
struct ObservationTerm {
  int pose = -1;  // index, -1 when the pose is constant
  int pose_row = -1;
  int camera_row = -1;
  int camera_size = 0;
  Eigen::Matrix<double, 2, 6> J_pose;
  Eigen::Matrix<double, 2, 3> J_point;
  IntrinsicsJacobian J_camera;  // left columns: the refined parameters
  Eigen::Vector2d residual;
  Eigen::Matrix<double, 6, 3> W;  // J_pose' J_point
};

struct RobustLoss {
  Loss kind;
  double scale;
  // Value at the squared residual s, and its derivative.
  double Value(double s) const;
  double Derivative(double s) const;
};

// Linearises an observation of `point`; false when it lies behind the camera.
bool Linearise(const Bundle& bundle, const BundleLayout& layout, const RobustLoss& loss,
               const BundlePoint& point, const BundleObservation& observation,
               ObservationTerm* term);

// Half the sum of robust squared residuals over points [begin, end). A point behind a camera
// costs as much as a residual of 1,000 px.
double ReprojectionCost(const Bundle& bundle, const RobustLoss& loss, int begin, int end);

// 1 / sigma^2 of a parameter's prior; 0: it has none.
double PriorInformation(const BundleCamera& camera, int param);

// The weak priors on the cameras' parameters, half the sum of squares.
double CameraPriorCost(const Bundle& bundle);

// Applies the local increment (w, s): X_cam' = exp(w) X_cam - s.
void IncrementPose(const Eigen::Matrix<double, 6, 1>& delta, BundlePose* pose);

// The increment that leads from one pose to the other.
Eigen::Matrix<double, 6, 1> PoseIncrement(const BundlePose& from, const BundlePose& to);

}  // namespace skein
