#include "bundle/point_terms.h"

#include <Eigen/LU>

#include "bundle/factor_kernels.h"

namespace skein {
namespace {

// Adds the blocks of observation i with itself, with those that follow, and with the cameras.
void AddSchurBlocksOf(const PointTerms& point, int i, SchurBlocks* schur) {
  const ObservationTerm& a = point.terms[i];
  const Eigen::Matrix<double, 6, 3> Y = a.W * point.V_inverse;
  static const FactorKernel kernel = FactorKernelOf(FastestInstructionSet());
  kernel.add_product(Y.data(), a.W.data(), schur->pose_block(a.pose_row, a.pose_row).data());
  for (int j = i + 1; j < point.size; ++j) {
    const ObservationTerm& b = point.terms[j];
    if (b.pose_row < 0) continue;
    if (a.pose_row < b.pose_row) {
      kernel.add_product(Y.data(), b.W.data(), schur->pose_block(a.pose_row, b.pose_row).data());
    } else if (a.pose_row == b.pose_row) {  // the point twice in one image
      const Matrix6d twice = Y * b.W.transpose();
      schur->pose_block(a.pose_row, a.pose_row) += twice + twice.transpose();
    } else {
      kernel.add_product(b.W.data(), Y.data(), schur->pose_block(b.pose_row, a.pose_row).data());
    }
  }
  for (const Coupling& c : point.couplings) {
    schur->border_block(a.pose_row, c.row, 6, c.size).noalias() +=
        Y.lazyProduct(c.W.topRows(c.size).transpose());
  }
}

}  // namespace

void PointTerms::Set(const Bundle& bundle, const BundleLayout& layout, const RobustLoss& loss,
                     const BundlePoint& point, double lambda, int from, int stride) {
  if (static_cast<int>(terms.size()) < point.count) terms.resize(point.count);
  size = 0;
  V.setZero();
  gradient.setZero();
  for (int i = point.first + from; i < point.first + point.count; i += stride) {
    ObservationTerm& term = terms[size];
    if (!Linearise(bundle, layout, loss, point, bundle.observations[i], &term)) continue;
    V.noalias() += term.J_point.transpose() * term.J_point;
    gradient.noalias() += term.J_point.transpose() * term.residual;
    ++size;
  }
  damping = lambda * V.diagonal().cwiseMax(kMinDiagonal);
  V.diagonal() += damping;
  V_inverse = V.inverse();
}

void PointTerms::SetCouplings() {
  couplings.clear();
  for (int i = 0; i < size; ++i) {
    const ObservationTerm& term = terms[i];
    if (term.camera_row < 0) continue;
    Coupling* coupling = nullptr;
    for (Coupling& c : couplings) coupling = c.row == term.camera_row ? &c : coupling;
    if (coupling == nullptr) {
      couplings.emplace_back(term.camera_row, term.camera_size);
      coupling = &couplings.back();
    }
    coupling->W.topRows(term.camera_size) +=
        term.J_camera.leftCols(term.camera_size).transpose() * term.J_point;
  }
}

void AddDirect(const PointTerms& point, ReducedSystem* system) {
  for (int i = 0; i < point.size; ++i) {
    const ObservationTerm& term = point.terms[i];
    if (term.pose_row >= 0) {
      system->pose_block(term.pose_row).noalias() += term.J_pose.transpose() * term.J_pose;
      system->gradient.segment<6>(term.pose_row).noalias() +=
          term.J_pose.transpose() * term.residual;
    }
    if (term.camera_row < 0) continue;
    const auto J = term.J_camera.leftCols(term.camera_size);
    system->camera_block(term.camera_row, term.camera_size).noalias() +=
        J.transpose().lazyProduct(J);
    system->gradient.segment(term.camera_row, term.camera_size).noalias() +=
        J.transpose().lazyProduct(term.residual);
    if (term.pose_row < 0) continue;
    system->cross_block(term.pose_row, term.camera_size).noalias() +=
        term.J_pose.transpose().lazyProduct(J);
  }
}

void AddSchurGradient(const PointTerms& point, ReducedSystem* system) {
  const Eigen::Vector3d v = point.V_inverse * point.gradient;
  for (int i = 0; i < point.size; ++i) {
    const ObservationTerm& term = point.terms[i];
    if (term.pose_row < 0) continue;
    system->schur_gradient.segment<6>(term.pose_row).noalias() += term.W * v;
  }
  for (const Coupling& c : point.couplings) {
    system->schur_gradient.segment(c.row, c.size).noalias() += c.W.topRows(c.size).lazyProduct(v);
  }
}

void AddSchurBlocks(const PointTerms& point, SchurBlocks* schur) {
  for (int i = 0; i < point.size; ++i) {
    if (point.terms[i].pose_row >= 0) AddSchurBlocksOf(point, i, schur);
  }
  for (const Coupling& a : point.couplings) {
    const Eigen::Matrix<double, Eigen::Dynamic, 3, 0, kMaxIntrinsics, 3> Y =
        a.W.topRows(a.size) * point.V_inverse;
    for (const Coupling& b : point.couplings) {
      if (a.row > b.row) continue;
      schur->border_block(a.row, b.row, a.size, b.size).noalias() +=
          Y.lazyProduct(b.W.topRows(b.size).transpose());
    }
  }
}

}  // namespace skein
