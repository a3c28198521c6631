#include "bundle/implicit_system.h"

namespace skein {
namespace {

// Of the step's error, in the norm of the preconditioned system. The next step of
// Levenberg-Marquardt makes up for it.
constexpr double kTolerance = 1e-2;
constexpr int kMaxIterations = 40;

}  // namespace

ImplicitSystem::ImplicitSystem(const Bundle& bundle, const BundleLayout& layout)
    : ReducedSystem(layout.size),
      num_pose_rows_(6 * layout.num_free_poses),
      blocks_(kMaxIntrinsics, layout.size),
      cross_(layout.num_free_poses),
      camera_of_pose_(layout.num_free_poses),
      camera_of_row_(layout.size - num_pose_rows_) {
  for (size_t i = 0; i < bundle.cameras.size(); ++i) {
    const Rows rows = RowsOf(bundle, layout, static_cast<int>(i));
    for (int k = 0; k < rows.size; ++k) camera_of_row_[rows.first + k - num_pose_rows_] = rows;
  }
  for (size_t i = 0; i < bundle.poses.size(); ++i) {
    if (layout.pose_row[i] < 0) continue;
    camera_of_pose_[layout.pose_row[i] / 6] = RowsOf(bundle, layout, bundle.poses[i].camera);
  }
}

ImplicitSystem::Rows ImplicitSystem::RowsOf(const Bundle& bundle, const BundleLayout& layout,
                                            int camera) {
  if (layout.camera_row[camera] < 0) return {};
  return {layout.camera_row[camera], static_cast<int>(bundle.cameras[camera].refined.size())};
}

void ImplicitSystem::KeepPose(int row, const Eigen::Matrix<double, 6, 3>& W) {
  pose_rows_.push_back(row);
  poses_.push_back(W);
}

void ImplicitSystem::EndPoint(const Eigen::Matrix3d& V_inverse) {
  points_.push_back({poses_.size(), cameras_.size(), V_inverse});
}

void ImplicitSystem::SetMatrixZero() {
  blocks_.setZero();
  for (auto& block : cross_) block.setZero();
  poses_.clear();
  pose_rows_.clear();
  cameras_.clear();
  points_.clear();
}

void ImplicitSystem::Add(int row, int column, const double* values, int rows, int columns,
                         double sign) {
  const Eigen::Map<const Eigen::MatrixXd> block(values, rows, columns);
  if (column < num_pose_rows_) {
    blocks_.block(0, column, rows, columns) += sign * block;
  } else if (row >= num_pose_rows_) {
    const int first = camera_of_row_[row - num_pose_rows_].first;
    blocks_.block(row - first, column, rows, columns) += sign * block;
  } else {
    cross_[row / 6].leftCols(columns) += sign * block;
  }
}

void ImplicitSystem::AddMatrix(const ReducedSystem& other) {
  const auto& o = static_cast<const ImplicitSystem&>(other);
  blocks_ += o.blocks_;
  for (size_t i = 0; i < cross_.size(); ++i) cross_[i] += o.cross_[i];
}

void ImplicitSystem::AddDirectProduct(const Eigen::VectorXd& x, Eigen::VectorXd* y) const {
  for (int row = 0; row < num_pose_rows_; row += 6) {
    y->segment<6>(row).noalias() += blocks_.block<6, 6>(0, row) * x.segment<6>(row);
    const Rows& camera = camera_of_pose_[row / 6];
    if (camera.size == 0) continue;
    const auto W = cross_[row / 6].leftCols(camera.size);
    y->segment<6>(row) += W * x.segment(camera.first, camera.size);
    y->segment(camera.first, camera.size) += W.transpose() * x.segment<6>(row);
  }
  for (int row = num_pose_rows_; row < x.size();) {
    const int size = camera_of_row_[row - num_pose_rows_].size;
    y->segment(row, size) += blocks_.block(0, row, size, size) * x.segment(row, size);
    row += size;
  }
}

void ImplicitSystem::SubtractSchurProduct(const Eigen::VectorXd& x, Eigen::VectorXd* y) const {
  size_t pose = 0, camera = 0;
  for (const KeptPoint& point : points_) {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (size_t i = pose; i < point.poses_end; ++i) {
      sum.noalias() += poses_[i].transpose() * x.segment<6>(pose_rows_[i]);
    }
    for (size_t i = camera; i < point.cameras_end; ++i) {
      const Coupling& c = cameras_[i];
      sum += c.W.topRows(c.size).transpose() * x.segment(c.row, c.size);
    }
    sum = (point.V_inverse * sum).eval();
    for (; pose < point.poses_end; ++pose) {
      y->segment<6>(pose_rows_[pose]).noalias() -= poses_[pose] * sum;
    }
    for (; camera < point.cameras_end; ++camera) {
      const Coupling& c = cameras_[camera];
      y->segment(c.row, c.size) -= c.W.topRows(c.size) * sum;
    }
  }
}

Eigen::VectorXd ConjugateGradients::Multiply(const Eigen::VectorXd& damping,
                                             const Eigen::VectorXd& x) const {
  std::vector<Eigen::VectorXd> products(parts.size(), Eigen::VectorXd::Zero(x.size()));
  for_each([&](size_t i) { parts[i]->SubtractSchurProduct(x, &products[i]); });
  Eigen::VectorXd y = damping.cwiseProduct(x);
  parts[0]->AddDirectProduct(x, &y);
  for (const Eigen::VectorXd& product : products) y += product;
  return y;
}

Eigen::VectorXd ConjugateGradients::Precondition(const Eigen::VectorXd& damping,
                                                 const Eigen::VectorXd& r) const {
  Eigen::VectorXd known = Eigen::VectorXd::Zero(factor.size());
  for (int i = 0; i < r.size(); ++i) {
    if (factor_rows[i] >= 0) known[factor_rows[i]] = r[i];
  }
  known = factor.Apply(known);
  Eigen::VectorXd z(r.size());
  for (int i = 0; i < r.size(); ++i) {
    z[i] =
        factor_rows[i] >= 0 ? known[factor_rows[i]] : r[i] / (parts[0]->diagonal[i] + damping[i]);
  }
  return z;
}

bool ConjugateGradients::Solve(const Eigen::VectorXd& damping, const Eigen::VectorXd& b,
                               Eigen::VectorXd* x) const {
  x->setZero(b.size());
  Eigen::VectorXd r = b;
  Eigen::VectorXd z = Precondition(damping, r);
  Eigen::VectorXd p = z;
  double rz = r.dot(z);
  const double enough = kTolerance * kTolerance * rz;
  for (int i = 0; i < kMaxIterations && rz > enough; ++i) {
    const Eigen::VectorXd Sp = Multiply(damping, p);
    const double curvature = p.dot(Sp);
    if (!(curvature > 0)) return false;
    const double step = rz / curvature;
    *x += step * p;
    r -= step * Sp;
    z = Precondition(damping, r);
    const double next = r.dot(z);
    p = z + next / rz * p;
    rz = next;
  }
  return rz <= enough && x->allFinite();
}

}  // namespace skein
