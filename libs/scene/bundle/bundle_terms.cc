#include "bundle/bundle_terms.h"

#include <cmath>
#include <limits>
#include <stdexcept>

#include "sfm/pose.h"

namespace skein {
namespace {

constexpr double kBehindCameraResidualPx = 1000.0;

void CheckIndices(const Bundle& bundle) {
  const auto fail = [] { throw std::invalid_argument("bundle: index out of range"); };
  for (const BundlePose& pose : bundle.poses) {
    if (pose.camera < 0 || pose.camera >= static_cast<int>(bundle.cameras.size())) fail();
  }
  const int num_observations = static_cast<int>(bundle.observations.size());
  for (const BundlePoint& point : bundle.points) {
    if (point.first < 0 || point.count < 0 || point.first + point.count > num_observations) fail();
  }
  for (const BundleObservation& observation : bundle.observations) {
    if (observation.pose < 0 || observation.pose >= static_cast<int>(bundle.poses.size())) fail();
  }
}

}  // namespace

std::vector<PointRange> SplitPoints(const Bundle& bundle) {
  constexpr size_t kNumParts = 4;
  const int num_points = static_cast<int>(bundle.points.size());
  const size_t per_part = bundle.observations.size() / kNumParts + 1;
  std::vector<PointRange> parts;
  int begin = 0;
  size_t count = 0;
  for (int p = 0; p < num_points; ++p) {
    count += bundle.points[p].count;
    if (count < per_part && p + 1 < num_points) continue;
    parts.push_back({begin, p + 1});
    begin = p + 1;
    count = 0;
  }
  if (parts.empty()) parts.push_back({0, 0});
  return parts;
}

BundleLayout MakeLayout(const Bundle& bundle) {
  CheckIndices(bundle);
  BundleLayout layout;
  for (const BundlePose& pose : bundle.poses) {
    layout.pose_row.push_back(pose.constant ? -1 : 6 * layout.num_free_poses);
    layout.num_free_poses += !pose.constant;
    layout.camera_of_pose.push_back(pose.camera);
  }
  layout.size = 6 * layout.num_free_poses;
  for (const BundleCamera& camera : bundle.cameras) {
    layout.camera_row.push_back(camera.refined.empty() ? -1 : layout.size);
    layout.camera_size.push_back(static_cast<int>(camera.refined.size()));
    layout.size += layout.camera_size.back();
  }
  return layout;
}

double RobustLoss::Value(double s) const {
  const double c2 = scale * scale;
  switch (kind) {
    case Loss::kSquared:
      return s;
    case Loss::kSoftL1:
      return 2.0 * c2 * (std::sqrt(1.0 + s / c2) - 1.0);
    case Loss::kCauchy:
      return c2 * std::log1p(s / c2);
  }
  return s;
}

double RobustLoss::Derivative(double s) const {
  const double c2 = scale * scale;
  switch (kind) {
    case Loss::kSquared:
      return 1.0;
    case Loss::kSoftL1:
      return 1.0 / std::sqrt(1.0 + s / c2);
    case Loss::kCauchy:
      return 1.0 / (1.0 + s / c2);
  }
  return 1.0;
}

bool Linearise(const Bundle& bundle, const BundleLayout& layout, const RobustLoss& loss,
               const BundlePoint& point, const BundleObservation& observation,
               ObservationTerm* term) {
  const BundlePose& pose = bundle.poses[observation.pose];
  const BundleCamera& camera = bundle.cameras[pose.camera];
  term->pose_row = layout.pose_row[observation.pose];
  term->pose = term->pose_row < 0 ? -1 : observation.pose;
  term->camera_row = layout.camera_row[pose.camera];
  term->camera_size = layout.camera_size[pose.camera];
  const Eigen::Vector3d in_cam = pose.R * point.xyz + pose.t;
  Eigen::Vector2d pixel;
  Eigen::Matrix<double, 2, 3> J;
  IntrinsicsJacobian J_all;
  if (!ProjectWithJacobians(camera.model_id, camera.params, in_cam, &pixel, &J,
                            term->camera_row < 0 ? nullptr : &J_all)) {
    return false;
  }
  term->residual = pixel - observation.pixel;
  const double root = std::sqrt(loss.Derivative(term->residual.squaredNorm()));
  term->residual *= root;
  J *= root;
  term->J_point.noalias() = J * pose.R;
  for (int i = 0; i < term->camera_size && term->camera_row >= 0; ++i) {
    term->J_camera.col(i) = root * J_all.col(camera.refined[i]);
    if (camera.square_pixels && camera.refined[i] == 0)
      term->J_camera.col(i) += root * J_all.col(1);
  }
  if (term->pose_row < 0) return true;
  for (int row = 0; row < 2; ++row) {
    term->J_pose.row(row).head<3>() = in_cam.cross(J.row(row).transpose());
  }
  term->J_pose.rightCols<3>() = -J;
  term->W.noalias() = term->J_pose.transpose() * term->J_point;
  return true;
}

double ReprojectionCost(const Bundle& bundle, const RobustLoss& loss, int begin, int end) {
  double cost = 0;
  for (int p = begin; p < end; ++p) {
    const BundlePoint& point = bundle.points[p];
    for (int i = point.first; i < point.first + point.count; ++i) {
      const BundleObservation& observation = bundle.observations[i];
      const BundlePose& pose = bundle.poses[observation.pose];
      const BundleCamera& camera = bundle.cameras[pose.camera];
      Eigen::Vector2d pixel;
      const bool in_front =
          Project(camera.model_id, camera.params, pose.R * point.xyz + pose.t, &pixel);
      const double squared = in_front ? (pixel - observation.pixel).squaredNorm()
                                      : kBehindCameraResidualPx * kBehindCameraResidualPx;
      cost += 0.5 * loss.Value(squared);
    }
  }
  return cost;
}

double PriorInformation(const BundleCamera& camera, int param) {
  if (camera.prior_sigma.empty() || camera.prior_sigma[param] <= 0) return 0;
  return 1.0 / (camera.prior_sigma[param] * camera.prior_sigma[param]);
}

double CameraPriorCost(const Bundle& bundle) {
  double cost = 0;
  for (const BundleCamera& camera : bundle.cameras) {
    for (const int i : camera.refined) {
      if (PriorInformation(camera, i) == 0) continue;
      const double z = (camera.params[i] - camera.prior[i]) / camera.prior_sigma[i];
      cost += 0.5 * z * z;
    }
  }
  return cost;
}

void IncrementPose(const Eigen::Matrix<double, 6, 1>& delta, BundlePose* pose) {
  const Eigen::Vector3d w = delta.head<3>();
  const double angle = w.norm();
  const Eigen::Matrix3d dR =
      angle < 1e-12 ? Eigen::Matrix3d(Eigen::Matrix3d::Identity() + CrossProductMatrix(w))
                    : Eigen::AngleAxisd(angle, w / angle).toRotationMatrix();
  pose->R = Eigen::Quaterniond(dR * pose->R).normalized().toRotationMatrix();
  pose->t = dR * pose->t - delta.tail<3>();
}

Eigen::Matrix<double, 6, 1> PoseIncrement(const BundlePose& from, const BundlePose& to) {
  const Eigen::Matrix3d dR = to.R * from.R.transpose();
  const Eigen::AngleAxisd rotation(dR);
  Eigen::Matrix<double, 6, 1> delta;
  delta << rotation.angle() * rotation.axis(), dR * from.t - to.t;
  return delta;
}

std::vector<double> ReprojectionErrors(const Bundle& bundle) {
  std::vector<double> errors(bundle.observations.size(), std::numeric_limits<double>::infinity());
  for (const BundlePoint& point : bundle.points) {
    for (int i = point.first; i < point.first + point.count; ++i) {
      const BundlePose& pose = bundle.poses[bundle.observations[i].pose];
      const BundleCamera& camera = bundle.cameras[pose.camera];
      Eigen::Vector2d pixel;
      if (Project(camera.model_id, camera.params, pose.R * point.xyz + pose.t, &pixel)) {
        errors[i] = (pixel - bundle.observations[i].pixel).norm();
      }
    }
  }
  return errors;
}

}  // namespace skein
