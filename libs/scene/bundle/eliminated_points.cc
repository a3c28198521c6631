#include "bundle/eliminated_points.h"

namespace skein {

void EliminatedPoints::Begin(const Bundle& bundle, const PointRange& range) {
  poses_.clear();
  pose_rows_.clear();
  cameras_.clear();
  points_.clear();
  size_t num_observations = 0;
  for (int p = range.begin; p < range.end; ++p) num_observations += bundle.points[p].count;
  poses_.reserve(num_observations);
  pose_rows_.reserve(num_observations);
  points_.reserve(range.end - range.begin);
}

void EliminatedPoints::Add(int index, const PointTerms& point) {
  for (int i = 0; i < point.size; ++i) {
    const ObservationTerm& term = point.terms[i];
    if (term.pose_row < 0) continue;
    pose_rows_.push_back(term.pose_row);
    poses_.push_back(term.W);
  }
  cameras_.insert(cameras_.end(), point.couplings.begin(), point.couplings.end());
  points_.push_back(
      {index, poses_.size(), cameras_.size(), point.V_inverse, point.gradient, point.damping});
}

template <typename Function>
void EliminatedPoints::ForEachPull(const Eigen::VectorXd& x, const Function& function) const {
  size_t pose = 0, camera = 0;
  for (const Point& point : points_) {
    Eigen::Vector3d pull = Eigen::Vector3d::Zero();
    for (; pose < point.poses_end; ++pose) {
      pull.noalias() += poses_[pose].transpose() * x.segment<6>(pose_rows_[pose]);
    }
    for (; camera < point.cameras_end; ++camera) {
      const Coupling& c = cameras_[camera];
      pull += c.W.topRows(c.size).transpose() * x.segment(c.row, c.size);
    }
    function(point, pull);
  }
}

void EliminatedPoints::SubtractSchurProduct(const Eigen::VectorXd& x, Eigen::VectorXd* y) const {
  size_t pose = 0, camera = 0;
  ForEachPull(x, [&](const Point& point, const Eigen::Vector3d& pull) {
    const Eigen::Vector3d follow = point.V_inverse * pull;
    for (; pose < point.poses_end; ++pose) {
      y->segment<6>(pose_rows_[pose]).noalias() -= poses_[pose] * follow;
    }
    for (; camera < point.cameras_end; ++camera) {
      const Coupling& c = cameras_[camera];
      y->segment(c.row, c.size) -= c.W.topRows(c.size) * follow;
    }
  });
}

double EliminatedPoints::Move(const Eigen::VectorXd& y, std::vector<BundlePoint>* points) const {
  double decrease = 0;
  ForEachPull(y, [&](const Point& point, const Eigen::Vector3d& pull) {
    const Eigen::Vector3d delta = -(point.V_inverse * (point.gradient + pull));
    decrease += 0.5 * delta.dot(point.damping.cwiseProduct(delta) - point.gradient);
    (*points)[point.index].xyz += delta;
  });
  return decrease;
}

}  // namespace skein
