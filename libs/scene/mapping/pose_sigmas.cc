#include "mapping/pose_sigmas.h"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <utility>

#include "bundle/bundle_terms.h"
#include "core/statistics.h"
#include "sfm/camera.h"

namespace skein {
namespace {

using Matrix6d = Eigen::Matrix<double, 6, 6>;

// Errors of the map are shared by neighbouring points: more of them count as this many.
constexpr double kIndependentPoints = 100;

struct Information {
  Matrix6d matrix = Matrix6d::Zero();
  int num_points = 0;
  Matrix6d Scaled() const {
    return matrix * std::min(1.0, kIndependentPoints / std::max(1, num_points));
  }
};

// What a point says about the pose. False if nothing.
bool AddPoint(const Bundle& bundle, const BundleLayout& layout, const BundlePoint& point,
              Information* information, std::vector<double>* depths) {
  const RobustLoss loss{Loss::kCauchy, 1.0};
  Matrix6d U = Matrix6d::Zero();
  Eigen::Matrix3d V = Eigen::Matrix3d::Zero();
  Eigen::Matrix<double, 6, 3> W = Eigen::Matrix<double, 6, 3>::Zero();
  bool is_seen = false;
  for (int i = point.first; i < point.first + point.count; ++i) {
    ObservationTerm term;
    if (!Linearise(bundle, layout, loss, point, bundle.observations[i], &term)) continue;
    V += term.J_point.transpose() * term.J_point;
    if (bundle.observations[i].pose != 0) continue;
    U += term.J_pose.transpose() * term.J_pose;
    W += term.J_pose.transpose() * term.J_point;
    is_seen = true;
  }
  if (!is_seen) return false;
  if (!point.constant) {
    const Eigen::FullPivLU<Eigen::Matrix3d> lu(V);
    if (!lu.isInvertible()) return false;
    U -= W * lu.inverse() * W.transpose();
  }
  information->matrix += U;
  ++information->num_points;
  depths->push_back((bundle.poses[0].R * point.xyz + bundle.poses[0].t).z());
  return true;
}

template <typename Covariance>
double LargestSigma(const Covariance& covariance) {
  return std::sqrt(covariance.template selfadjointView<Eigen::Upper>().eigenvalues().maxCoeff());
}

// The largest standard deviation of a pixel over the corners of the camera's frame, for points at
// that depth. `covariance`: of the local increment (w, s), X' = exp(w) X - s.
double FrameSigma(const BundleCamera& camera, const Matrix6d& covariance, double depth) {
  const double focal = camera.params[CameraModelFocalLengthIdxs(camera.model_id)[0]];
  const std::vector<size_t>& centre = CameraModelPrincipalPointIdxs(camera.model_id);
  const double half_width = camera.params[centre[0]], half_height = camera.params[centre[1]];
  double largest = 0;
  for (const double x : {-half_width, half_width}) {
    for (const double y : {-half_height, half_height}) {
      const Eigen::Vector3d X = depth * Eigen::Vector3d(x / focal, y / focal, 1);
      Eigen::Matrix<double, 2, 3> J_project;
      J_project << 1, 0, -x / focal, 0, 1, -y / focal;
      J_project *= focal / depth;
      Eigen::Matrix<double, 3, 6> J_point;
      J_point << 0, X.z(), -X.y(), -1, 0, 0,  //
          -X.z(), 0, X.x(), 0, -1, 0,         //
          X.y(), -X.x(), 0, 0, 0, -1;
      const Eigen::Matrix<double, 2, 6> J = J_project * J_point;
      const Eigen::Matrix2d of_pixel = J * covariance * J.transpose();
      largest = std::max(largest, LargestSigma(of_pixel));
    }
  }
  return largest;
}

}  // namespace

PoseSigmas SigmasOfFirstPose(const Bundle& bundle) {
  const BundleLayout layout = MakeLayout(bundle);
  // Points that only one other photo sees, triangulated with it, share no errors with the map's.
  Information of_map, of_pairs;
  std::vector<double> depths;
  for (const BundlePoint& point : bundle.points) {
    const bool is_of_pair = !point.constant && point.count == 2;
    AddPoint(bundle, layout, point, is_of_pair ? &of_pairs : &of_map, &depths);
  }
  const Eigen::FullPivLU<Matrix6d> lu(of_map.Scaled() + of_pairs.Scaled());
  if (depths.empty() || !lu.isInvertible()) return {HUGE_VAL, HUGE_VAL};
  const Matrix6d covariance = lu.inverse();
  const double depth = UpperMedian(std::move(depths));
  return {LargestSigma(Eigen::Matrix3d(covariance.bottomRightCorner<3, 3>())) / depth,
          FrameSigma(bundle.cameras[bundle.poses[0].camera], covariance, depth)};
}

}  // namespace skein
